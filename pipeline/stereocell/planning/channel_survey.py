"""Survey each channel: choose one iso-level, one repair and one appearance for all of its tiles.

This module reads no voxels. It sums up what the passes over the voxels found
(building/passes.py), before the units are built.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stereocell.engine.run_steps import Results
from stereocell.filters.reach import median_size
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
    explain_uncertainty,
    given_level,
    level_of_tile,
)
from stereocell.planning.plan import Plan
from stereocell.planning.survey import ChannelSurvey, Curve, Survey, TileIso
from stereocell.planning.vessel_color import color_vessels
from stereocell.steps.find_window import Window
from stereocell.steps.sum_components import Sums
from stereocell.transfer.channel_statistics import make_appearance

KEPT_OF_MASK = 0.9  # share of a mask's voxels; a note warns if smoothing keeps less


@dataclass(frozen=True, slots=True)
class Chosen:
    """The iso-level that was chosen for a channel by its connected components.

    found       the channel's levels; empty if all voxels lie on one side of the chosen level
    index       index of the chosen level in `found.candidates`
    components  sums over the components of each tile at this level, by tile ID
    iso         the level in each tile, by tile ID
    """

    found: Found
    index: int
    components: Components
    iso: dict[str, TileIso]


def choose_level_of(
    plan: Plan,
    found: Found,
    evidence: Results[TileEvidence],
    components: Sequence[Results[Sums]],
) -> Chosen:
    """Return the level of one channel.

    components  sums over the components of each tile, for each candidate level in order
    """
    by_level = [dict(one) for one in components[: len(found.candidates)]]
    index = choose_by_components(plan.settings.isovalue, by_level)
    sums: Components = by_level[index] if by_level else {}
    if found.is_fixed and by_level:
        found = check_components(plan, found, sums)
    files = {"evidence": evidence.files()}
    if by_level:
        files["components"] = components[index].files()
    iso = {
        tile.id: level_of_tile(
            plan,
            tile,
            found,
            index,
            {kind: by_tile[tile.id] for kind, by_tile in files.items() if tile.id in by_tile},
        )
        for tile in plan.tiles
    }
    return Chosen(found, index, sums, iso)


def survey_channel(plan: Plan, channel: Channel, chosen: Chosen, window_file: str) -> ChannelSurvey:
    """Return the survey of one channel.

    window_file  file of the channel's window, relative to OUT
    """
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
    level = found.candidates[chosen.index] if found.candidates else None
    confidence = float(level is not None)  # 1 for a level that the settings state
    if isinstance(level, Level) and not found.is_given:
        confidence = level.confidence
    painter = plan.painter(channel)
    appearance = make_appearance(
        channel.name,
        channel.color,
        statistics=replace(found.window.statistics, background=found.background),
        level=_surface_level(plan, chosen),
        confidence=confidence,
        why_unclear=found.reason
        or explain_uncertainty(found, chosen.index, list(chosen.iso.values())),
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
    """Return the level for the channel's appearance; None: there is no surface."""
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
    """Yield a line for each channel from which a CT's table or head holder is left out."""
    holders = {one.base or one.name: windows[one.id].holder for one in plan.channels}
    for name, holder in holders.items():
        if holder is not None:
            pieces = ", ".join(holder.pieces)
            yield f"{name}: left out, {holder.WORDS}: {pieces} (--keep-holder builds it)"


def notes_on_survey(plan: Plan, survey: Survey, chosen: Mapping[str, Chosen]) -> Iterator[str]:
    """Yield the lines on each channel: masks, missing background, thinned planes, unsure levels."""
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
        yield "found no background to subtract: its iso-value counts from 0"
    if thinning := surveyed.thinning(plan):
        yield thinning
    if surveyed.appearance.surface_reason:
        yield surveyed.appearance.surface_reason
    if surveyed.appearance.surface == "unsure" and (near := surveyed.near_levels):
        yield f"near iso-values: {near}"


def _loss(plan: Plan, surveyed: ChannelSurvey, components: Components) -> str:
    """Return the remark on a mask that shrinks much by smoothing; empty: it does not."""
    inside = sum(one["voxels"] for one in components.values())
    counts = np.asarray(surveyed.statistics.histogram)
    share = counts[-1] / max(1, counts.sum())
    left = inside / math.prod(plan.region.shape) / share if share > 0 else 1.0
    if left >= KEPT_OF_MASK:
        return ""
    smoothing = float(plan.settings.surface.smoothing_um)
    return (
        f"; {left:.0%} of it is left after a median of 3 x 3 voxels and a Gaussian of "
        f"{smoothing:g} um (surface.smoothing_um)"
    )
