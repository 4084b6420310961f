"""Write the report: one HTML page that holds its own pictures and needs no network.

A whole slide has thousands of units. The page shows pictures and table rows of some of them, evenly
chosen, so that a phone can open it. Sums and remarks cover all units.
"""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.model.channel import SurfaceLevel
from stereocell.model.identifiers import from_identifier
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tile_content import APRON
from stereocell.model.tiling import Box, Tile
from stereocell.model.version import GENERATOR
from stereocell.model.volume import zyx_to_xyz
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import given_level, highest_of
from stereocell.planning.other_levels import OtherLevel, ends_of, find_other_levels
from stereocell.planning.plan import Plan
from stereocell.planning.survey import ChannelSurvey
from stereocell.preview.draw_slices import OUTLINE, Slice, cut_unit, draw_slices
from stereocell.preview.views import View, views_of
from stereocell.report import charts
from stereocell.report.draw_scenes import Picture, Scene, Surface, draw_scene
from stereocell.report.facts import Facts, UnitFacts, gather, sum_up
from stereocell.report.objects import LabelFacts, gather_labels
from stereocell.report.opening import find_opening
from stereocell.report.remarks import find_covers, find_remarks
from stereocell.report.select_units import choose_level, choose_units, thin_out
from stereocell.report.texture_facts import compare, sum_up_maps
from stereocell.report.texture_similarity import CLOSE_PX, ERROR_PX
from stereocell.report.thresholds import draw_cut, draw_threshold
from stereocell.report.tissue import TissueFacts, find_tissue
from stereocell.steps.unit_files import load_lods, load_volume, lod_file
from stereocell.storage.sealed_text import write_sealed_text
from stereocell.textures.unwrap import mip_levels_apart

TEMPLATE = Path(__file__).parent / "templates" / "report.html.j2"
MAX_PICTURED = 60  # largest number of units with pictures
MAX_ROWS = 400  # largest number of units in a table
# Largest number of triangles in one picture, of a tile and of the whole specimen
_TILE_TRIANGLES, _WHOLE_TRIANGLES = 400_000, 1_500_000
# pixels: width and largest height of a picture
_TILE_PX, _WHOLE_PX = (420, 420), (1120, 620)


def write_report(out: Path) -> None:
    """Write OUT/report/index.html from the files of OUT.

    Stage and bundle may be missing, and the page then says so. Raises OutputError where the plan or
    a unit is missing.
    """
    out_folder = OutFolder(out)
    facts = gather(out_folder)
    write_sealed_text(out_folder.report_file, render(out_folder, facts))


def render(out_folder: OutFolder, facts: Facts) -> str:
    """Return the report as one HTML page."""
    plan = facts.plan
    tissue = find_tissue(out_folder.out, plan)  # read first, since damaged files raise an error
    chosen = choose_units(len(plan.tiles), len(plan.channels), MAX_PICTURED)
    tiles = [plan.tiles[tile] for tile, _ in chosen]
    units = {(unit.tile.id, unit.channel.id): unit for unit in facts.units}
    labels = gather_labels(out_folder, plan)
    covers, rows = find_covers(facts.units), _channels(facts)
    with_others = [row["name"] for row in rows if row["others"]]
    scenes = [_scene(facts, None, labels), *(_scene(facts, tile) for tile in tiles)]
    cards = [
        [
            _card(facts, units[key])
            for channel in channels
            if (key := (plan.tiles[tile].id, plan.channels[channel].id)) in units
        ]
        for tile, channels in chosen
    ]
    pictured = [_inline(draw_scene(scene)) for scene in scenes]
    asked = out_folder.settings_file
    return _template().render(
        facts=facts,
        plan=plan,
        generator=GENERATOR,
        region_um=[n * s for n, s in zip(plan.region.shape, plan.spacing_um, strict=True)],
        tissue=None if tissue is None else _tissue(tissue),
        whole=pictured[0],
        whole_note=_drawn_note(facts.units, _WHOLE_TRIANGLES)
        if plan.channels
        else "Objects at their coarsest level of detail",
        opening=find_opening(facts, covers, labels, with_others),
        remarks=find_remarks(facts),
        channels=rows,
        labels=[(one, css_color(one.color)) for one in labels],
        thresholds=_thresholds(facts),
        tiles=[
            {
                "id": tile.id,
                "picture": pictured[i + 1],
                "voxels": tile.box.shape[::-1],
                "cards": cards[i],
            }
            for i, tile in enumerate(tiles)
        ],
        cards=sum(len(row) for row in cards),
        rows=_rows(facts.units),
        total=sum_up(facts.units),
        likenesses=compare(facts),
        padding=plan.settings.unwrap.padding,
        mips_apart=mip_levels_apart(plan.settings.unwrap.padding),
        error_px=ERROR_PX,
        close_px=CLOSE_PX,
        has_bundle=any(file.part == "bundle" for file in facts.files),
        parts={
            part: [file for file in facts.files if file.part == part]
            for part in dict.fromkeys(file.part for file in facts.files)
        },
        settings=asked.read_text("utf-8") if asked.is_file() else "",
    )


@cache
def _template() -> Template:
    environment = Environment(
        loader=FileSystemLoader(TEMPLATE.parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"count": _count, "size": _size, "seconds": _seconds, "um": _um}
    return environment.get_template(TEMPLATE.name)


def _tissue(found: TissueFacts) -> dict[str, Any]:
    """Return the template's values for the tissue classes."""
    return {
        **found.record,
        "picture": _inline(Picture(*found.picture)),
        "colors": [css_color(one["color"]) for one in found.record["classes"]],
    }


def _channels(facts: Facts) -> list[dict[str, Any]]:
    """Return the template's values for each channel."""
    rows = []
    for channel in facts.plan.channels:
        found = facts.survey[channel.id]
        appearance, suggested = found.appearance, found.statistics.suggested
        units = [unit for unit in facts.units if unit.channel == channel]
        levels = [u.iso_value for u in units if u.iso_value is not None]
        rows.append(
            {
                "name": channel.name,
                "color": css_color(appearance.color),
                "window": appearance.window,
                "iso_value": appearance.iso_value,
                "level": None if appearance.level is None else appearance.level.words,
                "reason": appearance.surface_reason,
                "near": "" if given_level(facts.plan, channel) else found.near_levels,
                "confidence": appearance.iso_confidence,
                "repair": found.repair,
                "thinned": found.thinning(facts.plan),
                "spread": (min(levels), max(levels)) if levels else None,
                "above": found.statistics.background is not None,
                "candidates": _candidates(found),
                "others": _others(facts, channel, found),
                "arcs": len(suggested.shapes),
                "no_arcs": suggested.reason,
                "given": given_level(facts.plan, channel) is not None,
                "histogram": charts.histogram(
                    found.statistics.histogram,
                    appearance.transfer_functions,
                    appearance.iso_normalized,
                ),
                "functions": list(appearance.transfer_functions),
                "total": sum_up(units),
                "maps": sum_up_maps(units),
                "painted_by": from_identifier(appearance.painted_by),
            }
        )
    return rows


def _thresholds(facts: Facts) -> list[dict[str, Any]]:
    """Return the template's values for the adaptive thresholds, each with slices of one tile."""
    inner = slice(APRON, -APRON)
    rows = []
    # The voxels of a tissue class are probabilities, and their histogram has no such threshold.
    for channel in (one for one in facts.plan.channels if not one.source):
        unit = _clearest_unit(facts, channel)
        found = facts.survey[unit.channel.id]
        figure = draw_threshold(found.statistics)
        share = found.appearance.threshold_normalized
        if figure is None or share is None:
            continue
        volume = load_volume(unit.directory)[inner, inner, inner]
        picture = _inline(draw_cut(volume, facts.plan.spacing_um, share, views=_views(facts.plan)))
        rows.append(
            {
                "name": unit.channel.name,
                "color": css_color(found.appearance.color),
                "figure": figure,
                "tile": unit.tile.id,
                "picture": picture,
            }
        )
        if len(rows) == MAX_PICTURED:
            break
    return rows


def _candidates(found: ChannelSurvey) -> dict[str, Any] | None:
    """Return the iso-values that were found, with their histogram; None where there are none."""
    curve, level = found.curve, found.appearance.level
    if curve is None or len(curve.values) < 2 or not found.levels:
        return None
    along = np.linspace(0, 1, len(curve.values))
    places = {one.value: float(np.interp(one.value, curve.values, along)) for one in found.levels}
    taken = [] if level is None else [float(np.interp(level.iso, curve.values, along))]
    return {
        "chart": charts.candidates(curve.heights, taken=taken, others=list(places.values())),
        "ends": (curve.values[0], curve.values[-1]),
        "rows": [
            {
                "level": one,
                "reason": one.why_unclear,
                "taken": level is not None and one.value == level.iso,
            }
            for one in found.levels
        ],
    }


def _clearest_unit(facts: Facts, channel: Channel) -> UnitFacts:
    """Return the unit of a channel with the most triangles, or else the one in the middle."""
    units = [unit for unit in facts.units if unit.channel == channel]
    with_surface = [unit for unit in units if unit.lods]
    if not with_surface:
        return units[len(units) // 2]
    return max(with_surface, key=lambda unit: unit.lods[0].triangles)


def _others(facts: Facts, channel: Channel, found: ChannelSurvey) -> list[dict[str, Any]]:
    """Return the next-best iso-values of a channel, each with a picture of its contour."""
    unit = _clearest_unit(facts, channel)
    low, high = found.statistics.window
    return [
        {
            "name": other.name,
            "value": f"{other.value:.5g}{' above the background' if other.above else ''}",
            "setting": other.setting,
            "confidence": other.confidence,
            # Stored voxels end at the display window, so a value outside of it has no contour.
            "window": None if other.above or low < other.value < high else (low, high),
            "tile": unit.tile.id,
            "picture": _inline(Picture(*draw_slices(_cut(facts, unit, other)))),
        }
        for other in find_other_levels(
            facts.plan,
            channel,
            found.levels,
            subtracts=found.statistics.background is not None,
            taken=None if found.appearance.level is None else found.appearance.level.iso,
            threshold=found.appearance.threshold,
            ends=None if found.curve is None else ends_of(found.curve.values),
            highest=highest_of(found.statistics, found.statistics.background is not None),
        )
    ]


def _card(facts: Facts, unit: UnitFacts) -> dict[str, Any]:
    """Return the template's values for one unit, with pictures of its slices."""
    return {
        "unit": unit,
        "color": css_color(facts.survey[unit.channel.id].appearance.color),
        "slices": _inline(Picture(*draw_slices(_cut(facts, unit)))),
    }


def _cut(facts: Facts, unit: UnitFacts, other: OtherLevel | None = None) -> list[Slice]:
    """Return a unit's slices with its surface, or with the contour of another iso-value."""
    plan = facts.plan
    lattice = unit.tile.lattice(plan.region)
    inner = slice(APRON, -APRON)
    found = facts.survey[unit.channel.id]
    low, high = found.statistics.window
    iso = None if found.appearance.level is None else found.appearance.level.field
    background = found.statistics.background
    if other is not None:
        iso = SurfaceLevel(other.value, None, 0.0).field
        background = background if other.above else None
    slices = cut_unit(
        load_volume(unit.directory)[inner, inner, inner],
        lattice,
        first_um=plan.position_um(lattice.start),
        spacing_um=plan.spacing_um,
        mesh=load_lods(unit.directory)[0].mesh if unit.lods and other is None else None,
        sigma_um=float(plan.settings.surface.smoothing_um),
        iso_at=None if iso is None else partial(_in_eight_bits, iso, background, low, high),
        views=_views(plan),
    )
    if other is None:
        return slices
    # The contour is the only line, so it is drawn like a surface instead of dashed.
    return [
        replace(one, above=None, contours=() if one.above is None else ((OUTLINE, one.above),))
        for one in slices
    ]


def _views(plan: Plan) -> tuple[View, View, View]:
    return views_of(plan.placement, is_neurological=plan.settings.plan.neurological)


def _in_eight_bits(
    iso: LatticeField, background: LatticeField | None, low: float, high: float, box: Box
) -> NDArray[np.float32]:
    level = iso.at(box) if background is None else iso.at(box) + background.at(box)
    return (np.broadcast_to(level, box.shape) - np.float32(low)) * np.float32(255 / (high - low))


def _scene(facts: Facts, tile: Tile | None, labels: Sequence[LabelFacts] = ()) -> Scene:
    """Return the scene of a tile, or of the whole specimen if `tile` is None.

    labels  label maps, which are drawn only if the plan has no image channels
    """
    tiles = facts.plan.tiles if tile is None else (tile,)
    most = _WHOLE_TRIANGLES if tile is None else _TILE_TRIANGLES
    units = [u for u in facts.units if u.lods and (tile is None or u.tile == tile)]
    level, every = _level(units, most)
    boxes = [_box_um(facts, t) for t in tiles]
    corners = np.array(boxes)
    return Scene(
        surfaces=tuple(
            Surface(
                str(lod_file(u.directory, min(level, len(u.lods) - 1)).absolute()),
                facts.survey[u.channel.id].appearance.color,
            )
            for u in (units[i] for i in thin_out(len(units), every))
        )
        + tuple(
            Surface(str(lod_file(folder, len(one.levels) - 1).absolute()), one.color)
            for one in (labels if not facts.plan.channels else ())
            for folder in one.units
        ),
        boxes=tuple(boxes),
        frame=(tuple(corners[:, 0].min(axis=0)), tuple(corners[:, 1].max(axis=0))),
        size=_WHOLE_PX if tile is None else _TILE_PX,
    )


def _level(units: Sequence[UnitFacts], most: int) -> tuple[int, int]:
    triangles = [[lod.triangles for lod in unit.lods] for unit in units]
    return choose_level(triangles, most) if triangles else (0, 1)


def _drawn_note(units: Sequence[UnitFacts], most: int) -> str:
    with_surface = [unit for unit in units if unit.lods]
    level, every = _level(with_surface, most)
    which = "" if every == 1 else f" (about one in {every} of the {len(with_surface):,} surfaces)"
    return f"Level of detail {level}{which}"


def _box_um(facts: Facts, tile: Tile) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the bounding box of a tile's mesh as two corners (x, y, z), world um."""
    lattice = tile.lattice(facts.plan.region)
    ends = [lattice.start, [end - 1 for end in lattice.stop]]
    corners = zyx_to_xyz([facts.plan.position_um(end) for end in ends])
    return tuple(corners.min(axis=0).tolist()), tuple(corners.max(axis=0).tolist())


def _rows(units: Sequence[UnitFacts]) -> list[UnitFacts]:
    """Return the units that tables list: all of them, or MAX_ROWS evenly chosen ones."""
    if len(units) <= MAX_ROWS:
        return list(units)
    return [units[i * len(units) // MAX_ROWS] for i in range(MAX_ROWS)]


def _inline(picture: Picture) -> Mapping[str, Any]:
    data = base64.b64encode(picture.data).decode()
    return {
        "src": f"data:image/webp;base64,{data}",
        "width": picture.width,
        "height": picture.height,
    }


def srgb(linear: Sequence[float]) -> tuple[float, float, float]:
    """Return sRGB 0..1 of linear RGB 0..1 (IEC 61966-2-1)."""
    red, green, blue = (
        12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055 for v in linear
    )
    return red, green, blue


def css_color(linear: Sequence[float]) -> str:
    """Return a linear RGB colour, 0..1, in the form of CSS: #rrggbb in sRGB."""
    return "#" + "".join(f"{round(255 * v):02x}" for v in srgb(linear))


def _count(number: int) -> str:
    return f"{number:,}"


def _size(count: int) -> str:
    """Return a number of bytes as text, with units in powers of 1000."""
    size, unit = float(count), "B"
    for larger in ("kB", "MB", "GB", "TB"):
        if size < 999.5:
            break
        size, unit = size / 1000, larger
    return f"{size:.0f} {unit}" if unit == "B" or size >= 99.5 else f"{size:.3g} {unit}"


def _seconds(seconds: float) -> str:
    if seconds < 0.01:
        return "< 0.01 s"
    if seconds >= 7200:
        return f"{seconds / 3600:.1f} h"
    return f"{seconds:.2f} s" if seconds < 10 else f"{seconds:,.0f} s"


def _um(length: float) -> str:
    """Return a length in um with three significant digits."""
    return f"{length:,.0f}" if length >= 999.5 else f"{length:.3g}"
