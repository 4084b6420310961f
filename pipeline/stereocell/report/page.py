"""Write the report: one HTML page that holds its own pictures and needs no network.

A whole slide has thousands of units. The page shows pictures and table rows of some of them, evenly
chosen, so that a phone can open it. Sums and remarks cover all units.
"""

import base64
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template

from stereocell.building.out_folder import OutFolder
from stereocell.engine.run import Engine
from stereocell.model.identifiers import from_identifier
from stereocell.model.version import GENERATOR
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import given_level
from stereocell.planning.survey import ChannelSurvey
from stereocell.report import charts
from stereocell.report.draw_scenes import Picture
from stereocell.report.facts import Facts, UnitFacts, gather, sum_up
from stereocell.report.objects import gather_labels
from stereocell.report.opening import find_opening
from stereocell.report.pictures import (
    WHOLE_TRIANGLES,
    Pictures,
    channels_with_threshold,
    clearest_unit,
    draw_pictures,
    level_in_picture,
    other_levels,
    pictured_units,
)
from stereocell.report.remarks import find_covers, find_remarks
from stereocell.report.texture_facts import compare, sum_up_maps
from stereocell.report.texture_similarity import CLOSE_PX, ERROR_PX
from stereocell.report.thresholds import draw_threshold
from stereocell.report.tissue import TissueFacts, find_tissue
from stereocell.storage.sealed_text import write_sealed_text
from stereocell.textures.unwrap import mip_levels_apart

TEMPLATE = Path(__file__).parent / "templates" / "report.html.j2"
MAX_ROWS = 400  # largest number of units in a table


def write_report(out: Path, engine: Engine, *, texture_similarity: bool = False) -> None:
    """Write OUT/report/index.html from the files of OUT.

    texture_similarity  whether pictures of coarser levels are compared with the finest level

    Stage and bundle may be missing, and the page then says so. Raises OutputError where the plan or
    a unit is missing.
    """
    out_folder = OutFolder(out)
    facts = gather(out_folder)
    html = render(out_folder, facts, engine, texture_similarity=texture_similarity)
    write_sealed_text(out_folder.report_file, html)


def render(out_folder: OutFolder, facts: Facts, engine: Engine, *, texture_similarity: bool) -> str:
    """Return the report as one HTML page."""
    plan = facts.plan
    tissue = find_tissue(out_folder.out, plan)  # read first, since damaged files raise an error
    labels = gather_labels(out_folder, plan)
    pictures = draw_pictures(facts, labels, engine)
    covers, rows = find_covers(facts.units), _channels(facts, pictures)
    with_others = [row["name"] for row in rows if row["others"]]
    tiles = _tiles(facts, pictures)
    asked = out_folder.settings_file
    return _template().render(
        facts=facts,
        plan=plan,
        generator=GENERATOR,
        region_um=[n * s for n, s in zip(plan.region.shape, plan.spacing_um, strict=True)],
        tissue=None if tissue is None else _tissue(tissue),
        whole=_inline(pictures.whole),
        whole_note=_drawn_note(facts.units, WHOLE_TRIANGLES)
        if plan.channels
        else "Objects at their coarsest level of detail",
        opening=find_opening(facts, covers, labels, with_others),
        remarks=find_remarks(facts),
        channels=rows,
        labels=[(one, css_color(one.color)) for one in labels],
        thresholds=_thresholds(facts, pictures),
        tiles=tiles,
        cards=sum(len(tile["cards"]) for tile in tiles),
        rows=_rows(facts.units),
        total=sum_up(facts.units),
        likenesses=compare(facts) if texture_similarity else [],
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


def _channels(facts: Facts, pictures: Pictures) -> list[dict[str, Any]]:
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
                "others": _others(facts, channel, pictures),
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


def _thresholds(facts: Facts, pictures: Pictures) -> list[dict[str, Any]]:
    """Return the template's values for the adaptive thresholds, each with slices of one tile."""
    rows = []
    for channel in channels_with_threshold(facts):
        unit = clearest_unit(facts, channel)
        found = facts.survey[channel.id]
        figure, picture = draw_threshold(found.statistics), pictures.units[unit.key].threshold
        assert figure is not None
        assert picture is not None
        rows.append(
            {
                "name": channel.name,
                "color": css_color(found.appearance.color),
                "figure": figure,
                "tile": unit.tile.id,
                "picture": _inline(picture),
            }
        )
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


def _others(facts: Facts, channel: Channel, pictures: Pictures) -> list[dict[str, Any]]:
    """Return the next-best iso-values of a channel, each with a picture of its contour."""
    unit = clearest_unit(facts, channel)
    low, high = facts.survey[channel.id].statistics.window
    levels = other_levels(facts, channel)
    drawn = pictures.units[unit.key].others if levels else ()
    return [
        {
            "name": other.name,
            "value": f"{other.value:.5g}{' above the background' if other.above else ''}",
            "setting": other.setting,
            "confidence": other.confidence,
            # Stored voxels end at the display window, so a value outside of it has no contour.
            "window": None if other.above or low < other.value < high else (low, high),
            "tile": unit.tile.id,
            "picture": _inline(picture),
        }
        for other, picture in zip(levels, drawn, strict=True)
    ]


def _tiles(facts: Facts, pictures: Pictures) -> list[dict[str, Any]]:
    """Return the template's values for the pictured tiles."""
    units = {unit.key: unit for unit in facts.units}
    rows = []
    for tile, channels in pictured_units(facts.plan):
        own = [units[tile.id, channel.id] for channel in channels]
        drawn = [(unit, pictures.units[unit.key].slices) for unit in own]
        rows.append(
            {
                "id": tile.id,
                "picture": _inline(pictures.tiles[tile.id]),
                "voxels": tile.box.shape[::-1],
                "cards": [_card(facts, unit, slices) for unit, slices in drawn if slices],
            }
        )
    return rows


def _card(facts: Facts, unit: UnitFacts, slices: Picture) -> dict[str, Any]:
    """Return the template's values for one unit, with the picture of its slices."""
    return {
        "unit": unit,
        "color": css_color(facts.survey[unit.channel.id].appearance.color),
        "slices": _inline(slices),
    }


def _drawn_note(units: Sequence[UnitFacts], most: int) -> str:
    with_surface = [unit for unit in units if unit.lods]
    level, every = level_in_picture(with_surface, most)
    which = "" if every == 1 else f" (about one in {every} of the {len(with_surface):,} surfaces)"
    return f"Level of detail {level}{which}"


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
