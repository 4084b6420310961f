"""Preview a channel's iso-value before a build: slices of a tile, a histogram and a table.

The iso-value is the whole channel's, found as in a build with the same settings. In a large dataset
it is found in some tiles that are spread evenly; the table then says so.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from PIL.PngImagePlugin import PngInfo

from stereocell.filters.denoise import denoise
from stereocell.isosurface.channel_level import ChannelLevels
from stereocell.isosurface.options import LEVELS
from stereocell.model.errors import NoSurfaceError, OutputError, UsageError
from stereocell.model.tiling import Tile
from stereocell.model.version import GENERATOR
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import (
    Found,
    check_histogram,
    find_level,
    given_level,
    highest_of,
)
from stereocell.planning.other_levels import ends_of, find_other_levels, take
from stereocell.planning.plan import Plan
from stereocell.planning.plan_notes import print_notes
from stereocell.planning.plan_source import source_of
from stereocell.planning.settings import Settings
from stereocell.planning.settle import settle
from stereocell.planning.survey_steps import evidence_step, window_step
from stereocell.preview.chosen_level import Chosen, choose_level
from stereocell.preview.draw_slices import Color, Slice, find_font, paint_slices
from stereocell.preview.views import views_of
from stereocell.steps.find_window import Window
from stereocell.steps.open_source import open_source
from stereocell.storage.atomic_write import replacing
from stereocell.storage.overwriting import require_free

COLORS: tuple[Color, ...] = (
    (255, 190, 40),
    (70, 190, 255),
    (255, 90, 150),
    (110, 220, 110),
    (190, 140, 255),
    (255, 255, 255),
)
LOOKED_AT = 100_000_000  # voxels in which the iso-value is found; a build uses all voxels
_EXPECTED = "nothing or a picture of the same source"
_SOURCE = "Source"  # key of the PNG's text that holds the fingerprint of the source
_LONGEST_PX = 900  # pixels, longest side of a slice
_CHART_PX = 200  # pixels, height of the histogram
_GROUND, _AXIS, _CURVE = (18, 20, 24), (90, 96, 104), (225, 228, 232)
_MARGIN_PX, _TEXT_PX = 14, 14


@dataclass(frozen=True, slots=True)
class Candidate:
    """An iso-value at which the surface could be extracted.

    level       iso-value, in voxel values
    above       whether `level` counts from the background
    raw         `level` plus the mean of the tile's background, if `above`
    inside      share of the tile's voxels above the iso-value, 0..1
    confidence  confidence of the channel, 0..1; None if not rated
    is_chosen   whether a build uses this iso-value
    setting     the flag that chooses it; empty if none is needed
    """

    name: str
    level: float
    above: bool
    raw: float
    inside: float
    confidence: float | None
    is_chosen: bool
    setting: str


@dataclass(frozen=True, slots=True)
class Preview:
    """The iso-values at which a channel's surface could lie, and the one that a build uses.

    no_surface_reason  reason why a build makes no surface; empty if it makes one
    basis              the tiles in which the iso-values were found, in words
    unsure             reason why a build calls its iso-value unsure; empty if it is clear or given
    """

    candidates: list[Candidate]
    no_surface_reason: str
    basis: str
    unsure: str = ""


def preview(
    source: str, channel_name: str, *, tile_id: str, out: Path | None, settings: Settings
) -> tuple[Preview, Path]:
    """Write the picture, and no other file; return the candidates and the picture's path.

    channel_name  name, ID or index
    out           a .png; None for iso_<channel>_<tile>.png in the current folder

    Raises UsageError for a channel or tile that the plan lacks, NoSurfaceError if all voxels are
    nearly equal, SourceError if the source can't be read.
    """
    if out is not None and out.suffix.lower() != ".png":
        raise UsageError(f"-o is {str(out)!r}, expected a file name that ends in .png")
    plan = settle(source, settings)
    print_notes(plan)
    channel, tile = _find_channel(plan, channel_name), _find_tile(plan, tile_id)
    path = out or Path(f"iso_{channel.id}_{tile.id}.png")
    require_picture_or_nothing(path)
    require_free(path, expected=_EXPECTED, is_ours=_source_of_picture(path) == plan.fingerprint)
    window = window_step(plan, channel).run()
    tiles = _spread(plan, tile)
    evidence = {
        one.id: evidence_step(plan, one.box, channel=channel, window=window).run() for one in tiles
    }
    found = check_histogram(find_level(plan, channel, window, evidence))
    volume = open_source(source_of(plan, channel=channel)).read(channel.index, tile.box, plan.level)
    smoothing_um = float(plan.settings.surface.smoothing_um)
    field = denoise(volume, smoothing_um, window.max_shift)
    if window.holder is not None:  # a build's surface leaves these pieces out, and so do contours
        field = window.holder.left_out_of(field, tile.box)
    under = np.zeros((1, 1, 1), np.float32)
    if window.statistics.background is not None:
        under = window.statistics.background.at(tile.box)
    above = field - under if found.subtracts else field
    chosen = choose_level(plan, found, tiles, tile=tile, field=above)
    candidates = _candidates(plan, channel, found, chosen, field, under)
    if not candidates:
        raise NoSurfaceError(
            f"{tile.id}/{channel.name}: all voxels are nearly equal, so there is no surface"
        )
    where = f"{len(tiles)} of {len(plan.tiles)}" if len(tiles) < len(plan.tiles) else "all"
    is_given = given_level(plan, channel) is not None
    basis = f"{'given, and others found' if is_given else 'found'} on {where} tiles"
    if where != "all":
        basis += "; a build uses all tiles"
    if window.holder is not None:
        basis += f"; a build leaves out {', '.join(window.holder.pieces)}, {window.holder.WORDS}"
    result = Preview(candidates, found.reason, basis, chosen.unsure)
    picture = _compose(
        paint_slices(
            _slices(volume.voxels, field, under, candidates, window, plan),
            _LONGEST_PX,
            shown_px=_LONGEST_PX,
        ),
        f"{channel.name}, tile {tile.id} of {plan.name}",
        result,
        found.levels,
    )
    with replacing(path) as temporary:
        picture.save(temporary, "PNG", pnginfo=_mark(plan))
    return result, path


def _mark(plan: Plan) -> PngInfo:
    """Return the texts in a PNG that identify its program and its source."""
    mark = PngInfo()
    mark.add_text("Software", GENERATOR)
    mark.add_text(_SOURCE, plan.fingerprint)
    return mark


def require_picture_or_nothing(path: Path) -> None:
    """Raise OutputError if a path holds anything but a picture of this command, of any source."""
    if path.is_dir():
        raise OutputError(f"{path}: found a folder, expected a file name that ends in .png")
    require_free(path, expected=_EXPECTED, is_ours=_source_of_picture(path) is not None)


def _source_of_picture(path: Path) -> str | None:
    """Return the fingerprint of the source of an earlier picture; None for any other file."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore"
            )  # Pillow warns if another file's header states a huge size
            with Image.open(path) as picture:
                found = picture.info.get(_SOURCE)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):  # not a picture
        return None
    return found if isinstance(found, str) else None


def _spread(plan: Plan, tile: Tile) -> list[Tile]:
    """Return all tiles if they are few; else some, spread evenly, and the tile that is shown."""
    voxels = int(np.prod(plan.region.shape, dtype=np.int64))
    count = max(1, len(plan.tiles) * LOOKED_AT // voxels)
    if count >= len(plan.tiles):
        return list(plan.tiles)
    places = np.linspace(0, len(plan.tiles) - 1, count).round().astype(int)
    chosen = {plan.tiles[place].id for place in places} | {tile.id}
    return [one for one in plan.tiles if one.id in chosen]


def table(result: Preview) -> list[str]:
    """Return the candidates as lines of text; a star marks the one that a build uses."""
    head = f"{'candidate':<18}{'iso-value':>12}{'raw':>12}{'inside':>10}{'confidence':>12}"
    lines = [f"{head}  choose it by"]
    for c in result.candidates:
        confidence = "-" if c.confidence is None else f"{c.confidence:.2f}"
        level = f"{c.level:.5g}{'+b' if c.above else ''}"
        lines.append(
            f"{c.name + (' *' if c.is_chosen else ''):<18}{level:>12}{c.raw:>12.5g}"
            f"{c.inside:>10.2%}{confidence:>12}  {c.setting}"
        )
    return [*lines, _note(result)]


def _note(result: Preview) -> str:
    """Return the line that says what a build does, and in which tiles this was found."""
    if not any(c.is_chosen for c in result.candidates):
        return f"a build makes no surface: {result.no_surface_reason}; {result.basis}"
    marks = " (b: the background)" if any(c.above for c in result.candidates) else ""
    unsure = f" and calls it unsure: {result.unsure}" if result.unsure else ""
    return f"* a build uses this one{unsure}{marks}; {result.basis}"


def _find_channel(plan: Plan, name: str) -> Channel:
    for channel in plan.channels:
        if name in (channel.name, channel.id, str(channel.index)):
            return channel
    names = ", ".join(channel.name for channel in plan.channels)
    raise UsageError(f"--channel is {name!r}, expected one of {names}")


def _find_tile(plan: Plan, tile_id: str) -> Tile:
    for tile in plan.tiles:
        if tile.id == tile_id:
            return tile
    first, last = plan.tiles[0].id, plan.tiles[-1].id
    known = first if first == last else f"a tile from {first} to {last}"
    raise UsageError(f"--tile is {tile_id!r}, expected {known}")


def _candidates(
    plan: Plan,
    channel: Channel,
    found: Found,
    chosen: Chosen,
    field: NDArray[np.float32],
    under: NDArray[np.float32],
) -> list[Candidate]:
    below = float(under.mean(dtype=np.float64))

    def candidate(
        name: str, level: float, above: bool, confidence: float | None, setting: str, chosen: bool
    ) -> Candidate:
        inside = np.count_nonzero(field - under > level if above else field > level) / field.size
        raw = level + below if above else level
        return Candidate(name, level, above, raw, float(inside), confidence, chosen, setting)

    all_levels = () if found.levels is None else found.levels.all_levels
    value = chosen.value
    candidates = []
    if value is not None:
        is_given, name = given_level(plan, channel) is not None, plan.settings.isovalue.criterion
        if is_given:
            name = "given"
        elif channel.level or name == LEVELS:
            name = channel.level or plan.settings.isovalue.level
        setting = take(plan, channel, value, above=found.subtracts) if is_given else ""
        candidates.append(candidate(name, value, found.subtracts, chosen.confidence, setting, True))
    threshold = found.window.statistics.threshold
    for other in find_other_levels(
        plan,
        channel,
        all_levels,
        subtracts=False if found.levels is None else found.levels.subtracts,
        taken=value,
        threshold=None if threshold is None or found.reason else threshold.value,
        ends=None if found.levels is None else ends_of(found.levels.curve()[0]),
        highest=highest_of(
            found.window.statistics, found.levels is not None and found.levels.subtracts
        ),
    ):
        candidates.append(
            candidate(other.name, other.value, other.above, other.confidence, other.setting, False)
        )
    return candidates


def _slices(
    voxels: NDArray[np.generic],
    field: NDArray[np.float32],
    under: NDArray[np.float32],
    candidates: Sequence[Candidate],
    window: Window,
    plan: Plan,
) -> list[Slice]:
    """Return the tile's middle slices in 8 bits of the window, with the candidates' contours."""
    low, high = window.statistics.window
    under = np.broadcast_to(under, field.shape)
    slices = []
    neurological = plan.settings.plan.neurological
    for view in views_of(plan.placement, is_neurological=neurological):
        order = view.order
        k = field.shape[order[0]] // 2
        shown = voxels.transpose(order)[k].astype(np.float32)
        plane, below = (values.transpose(order)[k] for values in (field, under))
        slices.append(
            Slice(
                view,
                view.plane(
                    np.round(np.clip((shown - low) / (high - low), 0, 1) * 255).astype(np.uint8)
                ),
                (plan.spacing_um[order[1]], plan.spacing_um[order[2]]),
                np.zeros((0, 2, 2)),
                None,
                # The contour of the chosen candidate comes last, and so is drawn on top.
                tuple(
                    (color, view.plane((plane - below if c.above else plane) - np.float32(c.level)))
                    for c, color in reversed(list(zip(candidates, COLORS, strict=False)))
                ),
            )
        )
    return slices


def _compose(
    slices: Image.Image, title: str, result: Preview, levels: ChannelLevels | None
) -> Image.Image:
    """Return a picture of the slices, the channel's histogram below them, and a legend."""
    candidates = result.candidates
    line = round(1.5 * _TEXT_PX)
    legend = 2 * _MARGIN_PX + line * (len(candidates) + 1)
    width = max(slices.width, 700) + 2 * _MARGIN_PX
    top = 2 * _MARGIN_PX + line
    chart_px = 0 if levels is None else _CHART_PX
    height = top + slices.height + _MARGIN_PX + chart_px + legend
    picture = Image.new("RGB", (width, height), _GROUND)
    draw, font = ImageDraw.Draw(picture), find_font(_TEXT_PX)
    draw.text((_MARGIN_PX, _MARGIN_PX), title, _CURVE, find_font(round(1.2 * _TEXT_PX)))
    picture.paste(slices, (_MARGIN_PX, top))
    chart = (_MARGIN_PX, top + slices.height + _MARGIN_PX, width - _MARGIN_PX)
    if levels is not None:
        _draw_histogram(draw, chart, candidates, levels)
    y = chart[1] + chart_px + _MARGIN_PX
    for candidate, color in zip(candidates, COLORS, strict=False):
        draw.rectangle((_MARGIN_PX, y + 3, _MARGIN_PX + 22, y + 13), fill=color)
        sure = "" if candidate.confidence is None else f", confidence {candidate.confidence:.2f}"
        star = " *" if candidate.is_chosen else ""
        above = f" above the background, {candidate.raw:.5g} raw" if candidate.above else ""
        words = (
            f"{candidate.name}{star}: {candidate.level:.5g}{above}, {candidate.inside:.2%} "
            f"inside{sure}"
        )
        draw.text((_MARGIN_PX + 32, y), words, _CURVE, font)
        y += line
    draw.text((_MARGIN_PX + 32, y), _note(result)[: width // 7], _CURVE, font)
    return picture


def _draw_histogram(
    draw: ImageDraw.ImageDraw,
    chart: tuple[int, int, int],
    candidates: Sequence[Candidate],
    levels: ChannelLevels,
) -> None:
    """Draw the channel's histogram at (left, top, right), with a line for each candidate."""
    left, top, right = chart
    bottom = top + _CHART_PX - _TEXT_PX - 8
    values, heights = levels.curve()
    if len(values) < 2:
        return
    along = np.linspace(left, right, len(values))
    draw.line((left, bottom, right, bottom), fill=_AXIS)
    for candidate, color in reversed(list(zip(candidates, COLORS, strict=False))):
        if candidate.above == levels.subtracts:
            x = float(np.interp(candidate.level, values, along))
            draw.line((x, top, x, bottom), fill=color, width=2)
    points = [(x, bottom - (bottom - top) * y) for x, y in zip(along, heights, strict=True)]
    draw.line(points, fill=_CURVE, width=2)
    font = find_font(_TEXT_PX)
    draw.text((left, bottom + 4), f"{values[0]:.4g}", _AXIS, font)
    draw.text((right, bottom + 4), f"{values[-1]:.4g}", _AXIS, font, anchor="ra")
    middle = (left + right) / 2
    words = "number of voxels in the whole channel, over voxel values on a compressed scale"
    draw.text((middle, bottom + 4), words, _AXIS, font, anchor="ma")
