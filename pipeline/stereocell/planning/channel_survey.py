"""The survey of the channels: one level, repair and appearance for all tiles of each.

Pure: the passes over the voxels come before (building/passes.py), and the units after.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stereocell.engine.run_steps import Results
from stereocell.filters.denoise import median_size
from stereocell.isosurface.level import Level
from stereocell.isosurface.level_evidence import TileEvidence
from stereocell.isosurface.repair_rules import choose_repair
from stereocell.model.channel import Appearance, SurfaceLevel
from stereocell.model.lattice_field import make_iso_field
from stereocell.model.modality import SEGMENTATION
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import (
    Components,
    Found,
    check_components,
    choose_by_components,
    find_doubt,
    given_level,
    level_of_tile,
)
from stereocell.planning.plan import Plan
from stereocell.planning.survey import ChannelSurvey, Curve, Survey, TileIso
from stereocell.planning.vessel_color import color_vessels
from stereocell.steps.find_window import Window
from stereocell.steps.sum_components import Sums
from stereocell.transfer.channel_statistics import make_appearance

KEPT_OF_MASK = 0.9  # share of a mask's voxels; a note says when smoothing leaves less


@dataclass(frozen=True, slots=True)
class Chosen:
    """The level that a channel's components speak for.

    found       what is known of the channel's levels; without levels if this one parts nothing
    rung        index into the channel's levels
    components  the sums over the components of each tile at this level
    iso         each tile's part of the level
    """

    found: Found
    rung: int
    components: Components
    iso: dict[str, TileIso]


def choose_level_of(
    plan: Plan,
    found: Found,
    evidence: Results[TileEvidence],
    components: Sequence[Results[Sums]],
) -> Chosen:
    """Return the level of one channel; `components`: of each level that it may have."""
    of_rungs = [dict(one) for one in components[: len(found.rungs)]]
    rung = choose_by_components(plan.settings.isovalue, of_rungs)
    sums: Components = of_rungs[rung] if of_rungs else {}
    if found.is_fixed and of_rungs:
        found = check_components(plan, found, sums)
    files = {"evidence": evidence.files()}
    if of_rungs:
        files["components"] = components[rung].files()
    iso = {
        tile.id: level_of_tile(
            plan,
            tile,
            found,
            rung,
            {what: by_tile[tile.id] for what, by_tile in files.items() if tile.id in by_tile},
        )
        for tile in plan.tiles
    }
    return Chosen(found, rung, sums, iso)


def survey_channel(plan: Plan, channel: Channel, chosen: Chosen, window_file: str) -> ChannelSurvey:
    """Return the survey of one channel; `window_file`: the file of its window, relative to OUT."""
    found, components = chosen.found, chosen.components.values()
    most_faces = max((one["kept_faces"] for one in components), default=0)
    large, thin = (sum(one[key] for one in components) for key in ("large_voxels", "thin_voxels"))
    thin_share = thin / large if large else 0.0
    surveyed = ChannelSurvey(
        replace(found.window.statistics, background=found.background),
        window_file,
        chosen.iso,
        choose_repair(
            components,
            plan.repair,
            surface=plan.settings.surface,
            spacing_um=plan.spacing_um,
        ),
        appearance_of(plan, channel, chosen),
        () if found.levels is None else found.levels.all_levels,
        None if found.levels is None else Curve(*found.levels.curve()),
        found.window.holder,
        plan.grid_for(most_faces, thin_share),
        most_faces,
        thin_share,
    )
    return color_vessels(surveyed, modality=plan.modality)


def appearance_of(plan: Plan, channel: Channel, chosen: Chosen) -> Appearance:
    """Return how a channel is drawn in all tiles."""
    found = chosen.found
    level = found.rungs[chosen.rung] if found.rungs else None
    confidence = float(level is not None)  # a level that the settings state is no guess
    if isinstance(level, Level) and not found.is_given:
        confidence = level.confidence
    painter = plan.painter(channel)
    appearance = make_appearance(
        channel.name,
        channel.color,
        statistics=replace(found.window.statistics, background=found.background),
        level=_surface_level(plan, chosen),
        confidence=confidence,
        why_unclear=found.doubt or find_doubt(found, chosen.rung, list(chosen.iso.values())),
        modality=SEGMENTATION if channel.source else plan.modality,
        is_hounsfield=plan.is_hounsfield,
        unevenness=max(plan.spacing_um) / min(plan.spacing_um),
        level_percentile=plan.settings.window.volume_percentile,
        depth_voxels=min(
            n * spacing / min(plan.spacing_um)
            for n, spacing in zip(plan.region.shape, plan.spacing_um, strict=True)
        ),
    )
    return replace(appearance, painted_by=painter.id if painter else "")


def _surface_level(plan: Plan, chosen: Chosen) -> SurfaceLevel | None:
    """Return the level as the volume's appearance states it; None: there is no surface."""
    values = {tile: one.value for tile, one in chosen.iso.items()}
    known = [value for value in values.values() if value is not None]
    if not known:
        return None
    return SurfaceLevel(
        float(np.mean(known)),
        chosen.found.background,
        float(plan.settings.surface.smoothing_um),
        make_iso_field(plan.tiles, values) if len(set(known)) > 1 else None,
        median_size(plan.spacing_um, plan.slice_axis),
        chosen.found.window.max_shift,
    )


def notes_on_holders(plan: Plan, windows: Mapping[str, Window]) -> Iterator[str]:
    """Yield a line for each channel whose table or head holder is left out."""
    holders = {one.base or one.name: windows[one.id].holder for one in plan.channels}
    for name, holder in holders.items():
        if holder is not None:
            pieces = ", ".join(holder.pieces)
            yield f"{name}: left out, {holder.WORDS}: {pieces} (--keep-holder builds it)"


def notes_on_survey(plan: Plan, survey: Survey, chosen: Mapping[str, Chosen]) -> Iterator[str]:
    """Yield the lines on each channel: a mask, no background, thinned planes, no clear level."""
    for channel in plan.channels:
        surveyed = survey[channel.id]
        for remark in _remarks(plan, channel, surveyed, chosen[channel.id]):
            yield f"{surveyed.appearance.name}: {remark}"


def _remarks(
    plan: Plan, channel: Channel, surveyed: ChannelSurvey, chosen: Chosen
) -> Iterator[str]:
    found = chosen.found
    mask = found.window.counting.mask
    if mask is not None and found.is_fixed and given_level(plan, channel) is None:
        remark = f"a mask of {mask[0]:g} and {mask[1]:g}, whose surface lies half-way"
        yield remark + _loss(plan, surveyed, chosen.components)
    if found.subtracts and found.background is None:
        yield "there is no background to subtract: its level counts from 0"
    if thinning := surveyed.thinning(plan):
        yield thinning
    if surveyed.appearance.surface_reason:
        yield surveyed.appearance.surface_reason
    if surveyed.appearance.surface == "unsure" and (near := surveyed.near_levels):
        yield f"near levels: {near}"


def _loss(plan: Plan, surveyed: ChannelSurvey, components: Components) -> str:
    """Return the remark on a mask that smoothing takes much of; empty: it does not."""
    inside = sum(one["voxels"] for one in components.values())
    counts = np.asarray(surveyed.statistics.histogram)
    share = counts[-1] / max(1, counts.sum())
    left = inside / math.prod(plan.region.shape) / share if share > 0 else 1.0
    if left >= KEPT_OF_MASK:
        return ""
    smoothing = float(plan.settings.surface.smoothing_um)
    return (
        f"; {left:.0%} of it is left by a median of 3 x 3 voxels and a Gaussian of {smoothing:g} "
        "um (surface.smoothing_um)"
    )
