"""Survey the channels: the statistics and iso-values of each, on which its tiles have to agree.

It is the first pass over the units, and its result, survey.json, steers the second one.
"""

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from stereocell.building.open_source import source_of
from stereocell.building.out_folder import OutFolder
from stereocell.building.plan import Channel, Plan
from stereocell.building.source_tasks import (
    around,
    box_to_json,
    input_key,
    reader_module,
    run_on_input,
)
from stereocell.building.survey_file import (
    AGAIN,
    ISO_VALUE,
    WINDOW,
    ChannelSurvey,
    Survey,
    TileIso,
    save_survey,
)
from stereocell.building.tasks import iso_value as iso_maker
from stereocell.building.tasks import window as window_maker
from stereocell.building.tasks.iso_value import IsoTask, write_iso
from stereocell.building.tasks.window import (
    StatisticsTask,
    statistics_from_json,
    write_statistics,
)
from stereocell.engine.run import Engine
from stereocell.isosurface.neighbour_consensus import (
    Reconciled,
    find_neighbours,
    reconcile_iso_values,
)
from stereocell.isosurface.options import CRITERIA
from stereocell.isosurface.repair_rules import choose_repair
from stereocell.model.tiling import Tile
from stereocell.storage.cache_key import key_of
from stereocell.storage.json_files import find_sealed, read_sealed
from stereocell.transfer.channel_statistics import ChannelStatistics, make_appearance


def survey_channels(out_folder: OutFolder, plan: Plan, engine: Engine) -> Survey:
    """Return (and write) each channel's statistics, iso-values and transfer functions."""
    all_statistics, windows = _all_statistics(out_folder, plan, engine)
    isos = _isos(out_folder, plan, engine, all_statistics)
    neighbours = find_neighbours(plan.tiles)
    survey = {}
    for channel in plan.channels:
        found = {tile.id: isos[tile.id, channel.id] for tile in plan.tiles}
        reconciled = (
            _as_given(found)
            if _is_given(plan, channel)
            else reconcile_iso_values(neighbours, found, plan.settings.isovalue.min_confidence)
        )
        statistics, painter = all_statistics[channel.id], plan.painter(channel)
        appearance = make_appearance(
            channel.name,
            channel.color,
            statistics=statistics,
            iso_values={
                tile: None if value is None else value + found[tile]["background"]
                for tile, value in reconciled.values.items()
            },
            confidence=reconciled.confidence,
            surface=reconciled.surface_confidence,
        )
        survey[channel.id] = ChannelSurvey(
            statistics,
            windows[channel.id].relative_to(out_folder.out).as_posix(),
            {
                tile: TileIso(
                    reconciled.values[tile],
                    f["background"],
                    reconciled.confidences[tile],
                    f["reason"] or _reason(f, reconciled.confidences[tile], plan),
                    f["file"],
                )
                for tile, f in found.items()
            },
            choose_repair(
                [f["solids"] for f in found.values() if "solids" in f],
                plan.repair,
                surface=plan.settings.surface,
                spacing_um=plan.spacing_um,
                surface_confidence=reconciled.surface_confidence,
            ),
            replace(appearance, painted_by=painter.id if painter else ""),
        )
    save_survey(out_folder, survey)
    return survey


def _as_given(found: Mapping[str, Mapping[str, Any]]) -> Reconciled:
    """Return the values that the user gave: who gives one is sure of it."""
    values = {tile: f["value"] for tile, f in found.items()}
    is_known = any(value is not None for value in values.values())
    confidences = {tile: f["confidence"] for tile, f in found.items()}
    return Reconciled(values, confidences, float(is_known), "clear" if is_known else "none")


def _reason(found: Mapping[str, Any], confidence: float, plan: Plan) -> str:
    """Return why a tile's surface is not clear; empty if it is."""
    least = plan.settings.isovalue.min_confidence
    if confidence >= least:
        return ""
    return (
        f"no clear surface: confidence {confidence:.2f}, expected at least {least:g}: at "
        f"{found['value']:.5g} the gradient is {found['sharpness']:.2f} times the tile's median, "
        f"{found['raggedness']:.0%} of the surface is ragged"
    )


def statistics_task(plan: Plan, channel: Channel) -> StatisticsTask:
    """Return the task that finds a channel's window and background."""
    settings = plan.settings
    # a value that is given speaks of the voxels as they are
    subtracts = not _is_given(plan, channel) and settings.surface.background_um != 0
    level, window = plan.level_of(channel), (0.0, 255.0) if channel.source else None
    ref = source_of(plan, channel)
    return StatisticsTask(ref, level, channel.index, plan.region, settings, subtracts, window)


def iso_task(plan: Plan, tile: Tile, *, channel: Channel, statistics: ChannelStatistics) -> IsoTask:
    """Return the task that finds one unit's iso-value."""
    return IsoTask(
        source_of(plan, channel),
        plan.level_of(channel),
        channel.index,
        tile.box,
        plan.settings,
        _given(plan, channel, statistics),
        around(statistics.background, tile.box),
    )


def _is_given(plan: Plan, channel: Channel) -> bool:
    """Whether a channel's iso-value is not sought tile by tile: the user's, or its threshold."""
    settings = plan.settings
    return channel.name in settings.iso_values or not CRITERIA[settings.isovalue.criterion].by_tile


def _given(plan: Plan, channel: Channel, statistics: ChannelStatistics) -> float | None:
    given = plan.settings.iso_values.get(channel.name)
    if given is None and _is_given(plan, channel) and statistics.threshold is not None:
        return statistics.threshold.value
    return given


def _all_statistics(
    out_folder: OutFolder, plan: Plan, engine: Engine
) -> tuple[dict[str, ChannelStatistics], dict[str, Path]]:
    """Return each channel's statistics, and the file that holds them, by channel id."""
    files: dict[str, Path] = {}
    tasks = []
    for channel in plan.channels:
        task = statistics_task(plan, channel)
        depends = [
            input_key(plan, channel),
            channel.index,
            box_to_json(plan.region),
            asdict(plan.settings.window),
            plan.settings.surface.background_um if task.subtracts else 0,
        ]
        file = out_folder.statistics_file(
            channel.id, key_of(depends, window_maker, reader_module(plan, channel))
        )
        files[channel.id] = file
        if find_sealed(file, WINDOW) is None:
            tasks.append((channel.id, (task, file)))
    run_on_input(plan, engine, "windows", write_statistics, tasks)
    found = {}
    for channel_id, file in files.items():
        content = read_sealed(file, WINDOW, AGAIN)
        found[channel_id] = statistics_from_json(content["statistics"])
    return found, files


def _isos(
    out_folder: OutFolder,
    plan: Plan,
    engine: Engine,
    all_statistics: Mapping[str, ChannelStatistics],
) -> dict[tuple[str, str], dict[str, Any]]:
    files, tasks = {}, []
    settings = plan.settings
    for tile in plan.tiles:
        for channel in plan.channels:
            task = iso_task(plan, tile, channel=channel, statistics=all_statistics[channel.id])
            depends = [
                input_key(plan, channel),
                channel.index,
                box_to_json(tile.box),
                asdict(settings.isovalue) | {"min_confidence": None},  # nothing to this pass
                settings.surface.smoothing_um,
                settings.surface.min_diagonal_um,
                task.given,
                None if task.background is None else task.background.to_json(),
            ]
            file = out_folder.iso_file(
                tile.id, channel.id, key_of(depends, iso_maker, reader_module(plan, channel))
            )
            files[tile.id, channel.id] = file
            if find_sealed(file, ISO_VALUE) is None:
                tasks.append((f"{tile.id}/{channel.name}", (task, file)))
    run_on_input(plan, engine, "iso-values", write_iso, tasks)
    return {
        unit: read_sealed(file, ISO_VALUE, AGAIN)
        | {"file": file.relative_to(out_folder.out).as_posix()}
        for unit, file in files.items()
    }
