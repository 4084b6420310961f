"""Survey the channels: the window and the level of each, one for all its tiles.

Three passes go before the units. Windows: each channel's window, background and scale. Evidence:
each tile's sums, which add up to the channel's levels. Components: what lies above the chosen
level, which decides how the surface is cleaned. The result, survey.json, steers the units.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from stereocell.building.out_folder import OutFolder
from stereocell.building.run_on_input import run_pass
from stereocell.building.survey_file import save_survey
from stereocell.engine.run import Engine, console
from stereocell.engine.run_steps import Kept, ReadOnDemand
from stereocell.engine.step import Step
from stereocell.filters.denoise import median_size
from stereocell.isosurface.level import Level
from stereocell.isosurface.level_evidence import TileEvidence
from stereocell.isosurface.repair_rules import choose_repair
from stereocell.model.channel import SurfaceLevel
from stereocell.model.lattice_field import make_iso_field
from stereocell.model.modality import SEGMENTATION
from stereocell.model.tiling import Tile
from stereocell.planning.channels import Channel, opens
from stereocell.planning.level_choice import (
    Components,
    Found,
    check_components,
    choose_by_components,
    find_doubt,
    find_level,
    given_level,
    level_of_tile,
)
from stereocell.planning.plan import Plan
from stereocell.planning.survey import ChannelSurvey, Curve, Survey, TileIso
from stereocell.planning.survey_steps import components_step, evidence_step, window_step
from stereocell.planning.vessel_color import color_vessels
from stereocell.steps.find_window import Window
from stereocell.steps.gather_evidence import GatherEvidence
from stereocell.steps.sum_components import SumComponents, Sums
from stereocell.transfer.channel_statistics import make_appearance

KEPT_OF_MASK = 0.9  # share of a mask's voxels: what loses more to smoothing is said


R = TypeVar("R")
_Results = dict[tuple[str, str], Kept[R]]  # of a pass, by tile and channel ID


def survey_channels(out_folder: OutFolder, plan: Plan, engine: Engine) -> Survey:
    """Return (and write) each channel's window, level, repair and transfer functions."""
    windows, files = _windows(out_folder, plan, engine)
    held = {channel.base or channel.name: windows[channel.id].holder for channel in plan.channels}
    for name, holder in held.items():
        if holder is not None:
            pieces = ", ".join(holder.pieces)
            about = f"left out, {holder.WORDS}: {pieces} (--keep-holder builds it)"
            console.print(f"units: {name}: {about}", markup=False)
    evidence = _evidence(out_folder, plan, engine, windows)
    survey, inside = {}, {}
    found = {
        channel.id: find_level(
            plan,
            channel,
            windows[channel.id],
            ReadOnDemand(
                {
                    tile.id: evidence[tile.id, channel.id]
                    for tile in plan.tiles
                    if (tile.id, channel.id) in evidence
                }
            ),
        )
        for channel in plan.channels
    }
    components = [
        _components(out_folder, plan, engine, found, rung)
        for rung in range(max((len(one.rungs) for one in found.values()), default=0))
    ]
    for channel in plan.channels:
        one = found[channel.id]
        of_rungs = [
            {tile.id: rung[tile.id, channel.id].read() for tile in plan.tiles}
            for rung in components[: len(one.rungs)]
        ]
        chosen = choose_by_components(plan.settings.isovalue, of_rungs)
        if of_rungs:
            inside[channel.id] = sum(one["voxels"] for one in of_rungs[chosen].values())
        if one.is_fixed and of_rungs:
            one = check_components(plan, one, of_rungs[chosen])
        iso = {
            tile.id: level_of_tile(
                plan,
                tile,
                one,
                chosen,
                {
                    what: out_folder.relative(result[tile.id, channel.id].place)
                    for what, result in (
                        ("evidence", evidence),
                        ("components", components[chosen] if of_rungs else {}),
                    )
                    if (tile.id, channel.id) in result
                },
            )
            for tile in plan.tiles
        }
        measured = _of_channel(
            plan, channel, one, chosen, iso, of_rungs[chosen] if of_rungs else {}, files[channel.id]
        )
        survey[channel.id] = color_vessels(measured, modality=plan.modality)
    save_survey(out_folder, survey)
    for channel in plan.channels:
        look, mask = survey[channel.id].appearance, windows[channel.id].counting.mask
        if mask is not None and found[channel.id].is_fixed and given_level(plan, channel) is None:
            remark = f"a mask of {mask[0]:g} and {mask[1]:g}, whose surface lies half-way"
            remark += _loss(plan, survey[channel.id], inside[channel.id])
            console.print(f"units: {look.name}: {remark}", markup=False)
        if found[channel.id].subtracts and found[channel.id].background is None:
            remark = "there is no background to subtract: its level counts from 0"
            console.print(f"units: {look.name}: {remark}", markup=False)
        if remark := survey[channel.id].thinning(plan):
            console.print(f"units: {look.name}: {remark}", markup=False)
        if look.surface_reason:
            console.print(f"units: {look.name}: {look.surface_reason}", markup=False)
        if look.surface == "unsure" and (near := survey[channel.id].near_levels):
            console.print(f"units: {look.name}: near levels: {near}", markup=False)
    return survey


def _loss(plan: Plan, survey: ChannelSurvey, inside: int) -> str:
    """Return what is said of a mask that smoothing takes much of; empty: it does not."""
    counts = np.asarray(survey.statistics.histogram)
    share = counts[-1] / max(1, counts.sum())
    left = inside / math.prod(plan.region.shape) / share if share > 0 else 1.0
    if left >= KEPT_OF_MASK:
        return ""
    smoothing = float(plan.settings.surface.smoothing_um)
    return (
        f"; {left:.0%} of it is left by a median of 3 x 3 voxels and a Gaussian of {smoothing:g} "
        "um (surface.smoothing_um)"
    )


def _of_channel(
    plan: Plan,
    channel: Channel,
    found: Found,
    chosen: int,
    iso: dict[str, TileIso],
    components: Components,
    file: str,
) -> ChannelSurvey:
    level = found.rungs[chosen] if found.rungs else None
    confidence = float(level is not None)  # of a level that the settings state: it is no guess
    if isinstance(level, Level) and not found.is_given:
        confidence = level.confidence
    values = {tile: one.value for tile, one in iso.items()}
    known = [value for value in values.values() if value is not None]
    painter, surface = plan.painter(channel), None
    statistics = replace(found.window.statistics, background=found.background)
    if known:
        surface = SurfaceLevel(
            float(np.mean(known)),
            found.background,
            float(plan.settings.surface.smoothing_um),
            make_iso_field(plan.tiles, values) if len(set(known)) > 1 else None,
            median_size(plan.spacing_um, plan.slice_axis),
            found.window.max_shift,
        )
    appearance = make_appearance(
        channel.name,
        channel.color,
        statistics=statistics,
        level=surface,
        confidence=confidence,
        doubt=found.doubt or find_doubt(found, chosen, list(iso.values())),
        modality=SEGMENTATION if channel.source else plan.modality,
        is_hounsfield=plan.is_hounsfield,
        unevenness=max(plan.spacing_um) / min(plan.spacing_um),
        level_percentile=plan.settings.window.volume_percentile,
        depth_voxels=min(
            n * spacing / min(plan.spacing_um)
            for n, spacing in zip(plan.region.shape, plan.spacing_um, strict=True)
        ),
    )
    most_faces = max((one["kept_faces"] for one in components.values()), default=0)
    large, thin = (
        sum(one[key] for one in components.values()) for key in ("large_voxels", "thin_voxels")
    )
    thin_share = thin / large if large else 0.0
    return ChannelSurvey(
        statistics,
        file,
        iso,
        choose_repair(
            components.values(),
            plan.repair,
            surface=plan.settings.surface,
            spacing_um=plan.spacing_um,
        ),
        replace(
            appearance,
            painted_by=painter.id if painter else "",
            opens=opens(channel, plan.channels),
        ),
        () if found.levels is None else found.levels.ladder,
        None if found.levels is None else Curve(*found.levels.curve()),
        found.window.holder,
        plan.grid_for(most_faces, thin_share),
        most_faces,
        thin_share,
    )


def _windows(
    out_folder: OutFolder, plan: Plan, engine: Engine
) -> tuple[dict[str, Window], dict[str, str]]:
    """Return each channel's window, and the file that holds it, by channel id."""
    kept = {}
    for channel in plan.channels:
        step = window_step(plan, channel)
        place = out_folder.statistics_file(channel.voxels_id, step.key)
        kept[channel.id] = Kept(channel.base or channel.name, step, place)
    run_pass(out_folder, plan, engine, "windows", kept.values())
    windows = {id_: one.read() for id_, one in kept.items()}
    return windows, {id_: out_folder.relative(one.place) for id_, one in kept.items()}


def _evidence(
    out_folder: OutFolder, plan: Plan, engine: Engine, windows: Mapping[str, Window]
) -> _Results[TileEvidence]:
    """Return the evidence of each tile of each channel that has voxels of the source."""

    def step_of(tile: Tile, channel: Channel) -> GatherEvidence | None:
        if channel.source:  # shares of tissue, whose level is known
            return None
        return evidence_step(plan, tile.box, channel=channel, window=windows[channel.id])

    return _run_by_tile(out_folder, plan, engine, "evidence", step_of)


def _components(
    out_folder: OutFolder, plan: Plan, engine: Engine, found: Mapping[str, Found], rung: int
) -> _Results[Sums]:
    """Return the sums over the components of each tile, of the channels that have such a rung."""

    def step_of(tile: Tile, channel: Channel) -> SumComponents | None:
        return components_step(plan, tile, channel, found[channel.id], rung)

    return _run_by_tile(out_folder, plan, engine, "components", step_of)


def _run_by_tile(
    out_folder: OutFolder,
    plan: Plan,
    engine: Engine,
    name: str,
    step_of: Callable[[Tile, Channel], Step[R] | None],
) -> _Results[R]:
    """Run a pass over the tiles; return each one's result, by tile and channel ID.

    step_of  returns the step of a tile of a channel; None: there is none
    """
    kept = {}
    for tile in plan.tiles:
        for channel in plan.channels:
            step = step_of(tile, channel)
            if step is not None:
                place = out_folder.tile_result(name, tile.id, channel.voxels_id, step.key)
                title = f"{tile.id}/{channel.base or channel.name}"
                kept[tile.id, channel.id] = Kept(title, step, place)
    run_pass(out_folder, plan, engine, name, kept.values())
    return kept
