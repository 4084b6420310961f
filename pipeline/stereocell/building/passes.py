"""The two passes over the units: first what neighbours must agree on, then the units themselves.

Pass one finds each channel's window, dataset-wide, and an iso-value for each (tile, channel).
Pass two builds meshes and volumes. Every result lies under a name that says what it depends on.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, TypeVar

from stereocell.building.input_unchanged import require_added, require_input
from stereocell.building.open_source import source_of
from stereocell.building.out_folder import OutFolder
from stereocell.building.plan import Channel, Plan, smoothed_plan
from stereocell.building.tasks import iso_value as iso_maker
from stereocell.building.tasks import unit as unit_maker
from stereocell.building.tasks import window as window_maker
from stereocell.building.tasks.iso_value import IsoTask, write_iso
from stereocell.building.tasks.unit import UnitTask, run_unit
from stereocell.building.tasks.window import StatisticsTask, write_statistics
from stereocell.building.unit import UnitInput
from stereocell.building.unit_files import is_whole
from stereocell.engine.run import Engine
from stereocell.isosurface.neighbour_consensus import (
    Reconciled,
    find_neighbours,
    reconcile_iso_values,
)
from stereocell.isosurface.options import ADAPTIVE
from stereocell.isosurface.repair import RepairOptions
from stereocell.isosurface.repair_rules import choose_repair
from stereocell.meshes.alpha_wrap import find_wrapper
from stereocell.model.errors import UsageError
from stereocell.model.lattice import Lattice
from stereocell.model.lattice_field import LatticeField, make_iso_field
from stereocell.model.tiling import Box, Tile
from stereocell.read.open_dataset import reader_of
from stereocell.storage.cache_key import key_of
from stereocell.storage.json_files import find_json, read_json, write_json
from stereocell.transfer.channel_statistics import (
    ChannelStatistics,
    make_appearance,
    statistics_from_json,
    statistics_to_json,
)

T = TypeVar("T")
R = TypeVar("R")

_STATISTICS, _ISO_VALUE = "units.schema.json#Display", "units.schema.json#IsoValue"
_AGAIN = "run `stereocell units OUT` again"


def run_passes(
    out_folder: OutFolder, plan: Plan, *, engine: Engine, only: str | None
) -> tuple[int, int]:
    """Build the units (or `only` one, `<tile>/<channel>`).

    Returns how many were not done already, and how many others are still to be built.

    Raises SourceError if the source is no longer what was planned, TasksFailedError once all
    others are finished.
    """
    wanted = {(tile_id, channel.id) for tile_id, channel in _select(plan, only)}
    content = _survey(out_folder, plan, engine)
    tasks, keys, others = [], {}, 0
    for name, task, key in unit_tasks(out_folder, plan, content):
        keys[name] = key
        if is_whole(task.directory):
            continue
        tile_id, channel_id = name.split("/")
        if (tile_id, channel_id) in wanted:
            channel = next(channel for channel in plan.channels if channel.id == channel_id)
            tasks.append((f"{tile_id}/{channel.name}", task))
        else:
            others += 1
    _run(plan, engine, "units", run_unit, tasks)
    if not others:  # all there: the stage may be made of them
        out_folder.save_units(plan, keys)
    return len(tasks), others


def unit_tasks(
    out_folder: OutFolder, plan: Plan, content: Mapping[str, Any]
) -> Iterator[tuple[str, UnitTask, str]]:
    """Yield `<tile>/<channel>`, task and key of every unit; `content` is what survey.json holds."""
    all_statistics = {id_: statistics_from_json(entry["display"]) for id_, entry in content.items()}
    fields = {
        channel_id: make_iso_field(plan.tiles, {t: f["value"] for t, f in entry["iso"].items()})
        for channel_id, entry in content.items()
    }
    plans = {id_: smoothed_plan(plan, entry["look"]["surface"]) for id_, entry in content.items()}
    for tile_id, channel in _select(plan, None):
        statistics = all_statistics[channel.id]
        painter = plan.painter(channel)
        painted = None if painter is None else (painter.index, all_statistics[painter.id].window)
        as_built = plans[channel.id]
        field = fields[channel.id]
        repair = RepairOptions(**content[channel.id]["repair"])
        task, key = _unit_task(
            out_folder, as_built, tile_id, channel, field, repair, statistics, painted
        )
        yield f"{tile_id}/{channel.id}", task, key


def _run(
    plan: Plan,
    engine: Engine,
    label: str,
    function: Callable[[T], R],
    tasks: Sequence[tuple[str, T]],
) -> list[R]:
    """Run tasks that read the source; it must be the one that was planned."""
    if not tasks:
        return []
    require_input(plan)
    require_added(plan)
    return engine.run(label, function, tasks)


def _select(plan: Plan, only: str | None) -> list[tuple[str, Channel]]:
    wanted = [(tile.id, channel) for tile in plan.tiles for channel in plan.channels]
    if only is None:
        return wanted
    chosen = [(t, c) for t, c in wanted if only in {f"{t}/{n}" for n in _names(c)}]
    if not chosen:
        raise UsageError(
            f"--only is {only!r}, expected TILE/CHANNEL with a tile from {plan.tiles[0].id} to "
            f"{plan.tiles[-1].id} and a channel of {', '.join(c.name for c in plan.channels)}"
        )
    return chosen


def _names(channel: Channel) -> tuple[str | int, ...]:
    """Return what a channel may be called; an index is one of the input's."""
    return (channel.name, channel.id) + (() if channel.source else (channel.index,))


def _survey(out_folder: OutFolder, plan: Plan, engine: Engine) -> dict[str, Any]:
    """Return (and write) each channel's statistics, iso-values and transfer functions."""
    all_statistics = _all_statistics(out_folder, plan, engine)
    isos = _isos(out_folder, plan, engine, all_statistics)
    neighbours = find_neighbours(plan.tiles)
    content = {}
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
        content[channel.id] = {
            "display": statistics_to_json(statistics),
            "iso": {
                tile: {
                    "value": reconciled.values[tile],
                    "background": f["background"],
                    "confidence": reconciled.confidences[tile],
                    "reason": f["reason"] or _reason(f, reconciled.confidences[tile], plan),
                    "file": f["file"],
                }
                for tile, f in found.items()
            },
            "repair": asdict(
                choose_repair(
                    [f["solids"] for f in found.values() if "solids" in f],
                    plan.repair,
                    surface=plan.settings.surface,
                    spacing_um=plan.spacing_um,
                    surface_confidence=reconciled.surface_confidence,
                )
            ),
            "look": asdict(replace(appearance, painted_by=painter.id if painter else "")),
        }
    write_json(out_folder.survey_file, content)
    return content


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
        _around(statistics.background, tile.box),
    )


def _is_given(plan: Plan, channel: Channel) -> bool:
    """Whether a channel's iso-value is not sought tile by tile: the user's, or its threshold."""
    settings = plan.settings
    return channel.name in settings.iso_values or settings.isovalue.criterion == ADAPTIVE


def _given(plan: Plan, channel: Channel, statistics: ChannelStatistics) -> float | None:
    given = plan.settings.iso_values.get(channel.name)
    if given is None and _is_given(plan, channel) and statistics.threshold is not None:
        return statistics.threshold.value
    return given


def _all_statistics(
    out_folder: OutFolder, plan: Plan, engine: Engine
) -> dict[str, ChannelStatistics]:
    files, tasks = {}, []
    for channel in plan.channels:
        task = statistics_task(plan, channel)
        depends = [
            _input_key(plan, channel),
            channel.index,
            _box(plan.region),
            asdict(plan.settings.window),
            plan.settings.surface.background_um if task.subtracts else 0,
        ]
        file = out_folder.statistics_file(
            channel.id, key_of(depends, window_maker, _reader(plan, channel))
        )
        files[channel.id] = file
        if find_json(file, _STATISTICS) is None:
            tasks.append((channel.id, (task, file)))
    _run(plan, engine, "windows", write_statistics, tasks)
    found = {}
    for channel_id, file in files.items():
        content = read_json(file, _STATISTICS, _AGAIN)
        found[channel_id] = statistics_from_json(content)
    return found


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
                _input_key(plan, channel),
                channel.index,
                _box(tile.box),
                asdict(settings.isovalue) | {"min_confidence": None},  # nothing to this pass
                settings.surface.smoothing_um,
                settings.surface.min_diagonal_um,
                task.given,
                None if task.background is None else task.background.to_json(),
            ]
            file = out_folder.iso_file(
                tile.id, channel.id, key_of(depends, iso_maker, _reader(plan, channel))
            )
            files[tile.id, channel.id] = file
            if find_json(file, _ISO_VALUE) is None:
                tasks.append((f"{tile.id}/{channel.name}", (task, file)))
    _run(plan, engine, "iso-values", write_iso, tasks)
    return {
        unit: read_json(file, _ISO_VALUE, _AGAIN)
        | {"file": file.relative_to(out_folder.out).as_posix()}
        for unit, file in files.items()
    }


def _unit_task(
    out_folder: OutFolder,
    plan: Plan,
    tile_id: str,
    channel: Channel,
    iso: LatticeField | None,
    repair: RepairOptions,
    statistics: ChannelStatistics,
    painted: tuple[int, tuple[float, float]] | None,
) -> tuple[UnitTask, str]:
    tile = plan.tile(tile_id)
    own = tile.lattice(plan.region)
    window = own.grown(plan.halo, plan.region)
    given = UnitInput(
        lattice=Lattice(window, own, plan.region, plan.spacing_um, plan.origin_um),
        iso=_around(iso, window),
        background=_around(statistics.background, window),
        repair=repair,
        step=plan.step,
        intensity_window=statistics.window,
        settings=plan.settings,
        painted=painted and painted[1],
    )
    depends = [
        _input_key(plan, channel),
        channel.index,
        [_box(box) for box in (window, own, plan.region)],
        [None if f is None else f.to_json() for f in (given.iso, given.background)],
        given.intensity_window,
        plan.settings.surface.smoothing_um,
        find_wrapper() if plan.settings.surface.wrap == "alpha-wrap" else None,
        plan.settings.surface.closed_tiles,
        [asdict(options) for options in (given.repair, plan.settings.lod)],
        given.step,
        asdict(plan.settings.unwrap),
        painted,
    ]
    key = key_of(depends, unit_maker, _reader(plan, channel))
    directory = out_folder.unit_dir(tile_id, channel.id, key)
    ref, index = source_of(plan, channel), painted and painted[0]
    return UnitTask(ref, plan.level_of(channel), channel.index, given, directory, index), key


def _around(field: LatticeField | None, box: Box) -> LatticeField | None:
    return None if field is None else field.around(box)


def _input_key(plan: Plan, channel: Channel) -> list[Any]:
    if channel.source:
        return [channel.fingerprint, 0, plan.spacing_um, plan.origin_um, 0]
    return [plan.fingerprint, plan.level, plan.spacing_um, plan.origin_um, plan.settings.plan.time]


def _reader(plan: Plan, channel: Channel) -> str:
    """Return the module that reads a channel: other formats' readers change nothing of it."""
    return reader_of(channel.source or plan.source)


def _box(box: Box) -> list[list[int]]:
    return [list(box.start), list(box.stop)]
