"""Preview one tile's iso-value before a build: slices with contours, the curve, a table.

The candidates are every criterion's level, and a value that the user gives. The field is the one
in which a build of the same settings searches the iso-value. The result covers one tile: a build
also considers the neighbours and may draw a found value towards theirs (`agreement`); it takes a
given value as is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from stereocell.building.channel_survey import iso_task, statistics_task
from stereocell.building.phases import settle
from stereocell.building.plan import Channel, Plan
from stereocell.building.settings import Settings
from stereocell.building.tasks.iso_value import IsoField, read_iso_field
from stereocell.building.tasks.window import measure_statistics
from stereocell.isosurface.isovalue import IsoValue
from stereocell.isosurface.options import ADAPTIVE, BY_TILE, CRITERIA
from stereocell.model.errors import NoSurfaceError, UsageError
from stereocell.model.tiling import Tile
from stereocell.preview.draw_slices import Color, Slice, find_font, paint_slices
from stereocell.preview.views import views_of
from stereocell.storage.atomic_write import replacing

COLORS: dict[str, Color] = {
    "edges": (255, 190, 40),
    "compromise": (70, 190, 255),
    "pekar-mean": (255, 90, 150),
    "pekar-total": (110, 220, 110),
    "pekar-area": (190, 140, 255),
    "given": (255, 255, 255),
    ADAPTIVE: (255, 255, 255),
}
_OTHER: Color = (160, 160, 160)  # of a criterion without a colour of its own
_LONGEST_PX = 900  # pixels, longest side of a slice
_CHART_PX = 200  # pixels, height of the curve
_GROUND, _AXIS, _CURVE = (18, 20, 24), (90, 96, 104), (225, 228, 232)
_MARGIN_PX, _TEXT_PX = 14, 14


@dataclass(frozen=True, slots=True)
class Candidate:
    """A level at which the surface could be taken.

    level       above the background, in voxel values; `raw`: with the background's mean added
    inside      share of the tile's voxels above it
    confidence  from this tile alone, 0..1; None: not rated
    is_chosen   given, or found by the criterion of the settings: a build starts from it
    """

    name: str
    level: float
    raw: float
    inside: float
    confidence: float | None
    is_chosen: bool


def preview(
    source: str, channel_name: str, *, tile_id: str, out: Path | None, settings: Settings
) -> tuple[list[Candidate], Path]:
    """Write the picture; return the candidates and the picture's path. Nothing else is written.

    channel_name  name, ID or index
    out           a .png; None: iso_<channel>_<tile>.png in the current folder

    Raises UsageError for a channel or tile that the plan lacks, NoSurfaceError where no level
    separates anything, SourceError where the source can't be read.
    """
    if out is not None and out.suffix.lower() != ".png":
        raise UsageError(f"-o is {str(out)!r}, expected a file named .png")
    plan = settle(source, settings)
    channel, tile = _find_channel(plan, channel_name), _find_tile(plan, tile_id)
    statistics = measure_statistics(statistics_task(plan, channel))
    task = iso_task(plan, tile, channel=channel, statistics=statistics)
    field = read_iso_field(task)
    try:
        chosen = field.find_iso_value(plan.settings.isovalue)
        criterion = plan.settings.isovalue.criterion
        found = {criterion if CRITERIA[criterion].by_tile else BY_TILE[0]: chosen}
        for name in BY_TILE:
            if name not in found:
                options = replace(plan.settings.isovalue, criterion=name)
                found[name] = field.find_iso_value(options)
    except NoSurfaceError as error:
        raise NoSurfaceError(f"{tile.id}/{channel.name}: {error}: no surface to look at") from None
    is_users = channel.name in plan.settings.iso_values
    candidates = _candidates(field, found, task.given, "given" if is_users else ADAPTIVE)
    path = out or Path(f"iso_{channel.id}_{tile.id}.png")
    picture = _compose(
        paint_slices(_slices(field, candidates, statistics.window, plan), _LONGEST_PX, _LONGEST_PX),
        f"{channel.name}, tile {tile.id} of {plan.name}",
        candidates,
        chosen,
    )
    with replacing(path) as temporary:
        picture.save(temporary, "PNG")
    return candidates, path


def table(candidates: Sequence[Candidate]) -> list[str]:
    """Return the candidates as lines of text; a star marks the one that a build starts from."""
    lines = [
        f"{'candidate':<14}{'above background':>17}{'raw':>12}{'inside':>10}{'confidence':>12}"
    ]
    for c in candidates:
        confidence = "-" if c.confidence is None else f"{c.confidence:.2f}"
        lines.append(
            f"{c.name + (' *' if c.is_chosen else ''):<14}{c.level:>17.5g}{c.raw:>12.5g}"
            f"{c.inside:>10.2%}{confidence:>12}"
        )
    return [*lines, _note(candidates)]


def _note(candidates: Sequence[Candidate]) -> str:
    """Return the star's meaning; a build also considers the neighbours, which are not read here."""
    if any(c.is_chosen and c.confidence is None for c in candidates):
        return "* given; a build takes it"
    return "* found; a build may draw it towards its neighbours'"


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
    field: IsoField, found: dict[str, IsoValue], given: float | None, by: str
) -> list[Candidate]:
    levels: list[tuple[str, float, float | None]] = [
        (name, value.value, value.confidence) for name, value in found.items()
    ]
    if given is not None:
        levels.insert(0, (by, given, None))
    return [
        Candidate(
            name=name,
            level=level,
            raw=level + field.below,
            inside=float(np.count_nonzero(field.values > level)) / field.values.size,
            confidence=confidence,
            is_chosen=index == 0,
        )
        for index, (name, level, confidence) in enumerate(levels)
    ]


def _slices(
    field: IsoField, candidates: Sequence[Candidate], window: tuple[float, float], plan: Plan
) -> list[Slice]:
    """Return the tile's mid-slices, windowed, with the candidates' contours."""
    low, high = window
    slices = []
    neurological = plan.settings.plan.neurological
    for view in views_of(plan.placement, is_neurological=neurological):
        order = view.order
        k = field.values.shape[order[0]] // 2
        voxels = field.volume.voxels.transpose(order)[k].astype(np.float32)
        plane = field.values.transpose(order)[k]
        slices.append(
            Slice(
                view,
                view.plane(
                    np.round(np.clip((voxels - low) / (high - low), 0, 1) * 255).astype(np.uint8)
                ),
                (plan.spacing_um[order[1]], plan.spacing_um[order[2]]),
                np.zeros((0, 2, 2)),
                None,
                # the chosen one last: on top
                tuple(
                    (COLORS.get(c.name, _OTHER), view.plane(plane - np.float32(c.level)))
                    for c in reversed(candidates)
                ),
            )
        )
    return slices


def _compose(
    slices: Image.Image, title: str, candidates: Sequence[Candidate], chosen: IsoValue
) -> Image.Image:
    """Return a picture of the slices, the criterion's curve below them, and a legend."""
    line = round(1.5 * _TEXT_PX)
    legend = 2 * _MARGIN_PX + line * (len(candidates) + 1)
    width = max(slices.width, 520) + 2 * _MARGIN_PX
    top = 2 * _MARGIN_PX + line
    height = top + slices.height + _MARGIN_PX + _CHART_PX + legend
    picture = Image.new("RGB", (width, height), _GROUND)
    draw, font = ImageDraw.Draw(picture), find_font(_TEXT_PX)
    draw.text((_MARGIN_PX, _MARGIN_PX), title, _CURVE, find_font(round(1.2 * _TEXT_PX)))
    picture.paste(slices, (_MARGIN_PX, top))
    chart = (_MARGIN_PX, top + slices.height + _MARGIN_PX, width - _MARGIN_PX)
    _draw_curve(draw, chart, candidates, chosen)
    y = chart[1] + _CHART_PX + _MARGIN_PX
    for candidate in candidates:
        draw.rectangle(
            (_MARGIN_PX, y + 3, _MARGIN_PX + 22, y + 13), fill=COLORS.get(candidate.name, _OTHER)
        )
        sure = "" if candidate.confidence is None else f", confidence {candidate.confidence:.2f}"
        star = " *" if candidate.is_chosen else ""
        words = (
            f"{candidate.name}{star}: {candidate.level:.5g} above the background, "
            f"{candidate.raw:.5g} raw, {candidate.inside:.2%} inside{sure}"
        )
        draw.text((_MARGIN_PX + 32, y), words, _CURVE, font)
        y += line
    draw.text((_MARGIN_PX + 32, y), _note(candidates), _CURVE, font)
    return picture


def _draw_curve(
    draw: ImageDraw.ImageDraw,
    chart: tuple[int, int, int],
    candidates: Sequence[Candidate],
    chosen: IsoValue,
) -> None:
    """Draw score over levels into the box (left, top, right), a line for each candidate."""
    left, top, right = chart
    bottom = top + _CHART_PX - _TEXT_PX - 8
    low, high = float(chosen.levels[0]), float(chosen.levels[-1])

    def x_of(level: float) -> float:
        return left + (right - left) * min(max((level - low) / (high - low), 0.0), 1.0)

    draw.line((left, bottom, right, bottom), fill=_AXIS)
    for candidate in reversed(candidates):
        x = x_of(candidate.level)
        draw.line((x, top, x, bottom), fill=COLORS.get(candidate.name, _OTHER), width=2)
    points = [
        (x_of(float(level)), bottom - (bottom - top) * float(score))
        for level, score in zip(chosen.levels, chosen.score, strict=True)
    ]
    draw.line(points, fill=_CURVE, width=2)
    font = find_font(_TEXT_PX)
    draw.text((left, bottom + 4), f"{low:.4g}", _AXIS, font)
    draw.text((right, bottom + 4), f"{high:.4g}", _AXIS, font, anchor="ra")
    middle = (left + right) / 2
    draw.text((middle, bottom + 4), "criterion over levels", _AXIS, font, anchor="ma")
