"""The passes over the units: first what all of a channel's tiles share, then the units themselves.

The survey finds each channel's window and level, dataset-wide (channel_survey.py). Then meshes and
volumes are built. Every result lies under a name that says what it depends on.
"""

from collections.abc import Iterable, Iterator
from dataclasses import asdict
from functools import partial
from itertools import chain, product

from stereocell.building.channel_survey import survey_channels
from stereocell.building.channels import Channel
from stereocell.building.label_maps import Labels
from stereocell.building.object_passes import locate_objects, object_tasks, save_notes, tell_objects
from stereocell.building.out_folder import OutFolder
from stereocell.building.plan import Plan
from stereocell.building.plan_source import source_of
from stereocell.building.running_pass import remove_mixed
from stereocell.building.source_tasks import (
    around,
    box_to_json,
    input_key,
    reader_module,
    run_on_input,
)
from stereocell.building.steps import build_unit as unit_maker
from stereocell.building.steps.build_objects import ObjectsTask, run_objects
from stereocell.building.steps.build_unit import UnitTask, run_unit
from stereocell.building.survey_file import Survey
from stereocell.building.unit import UnitInput
from stereocell.building.unit_files import is_whole
from stereocell.engine.run import Engine
from stereocell.isosurface.holder import Holder
from stereocell.isosurface.repair import RepairOptions
from stereocell.meshes.alpha_wrap import find_wrapper
from stereocell.model.channel import SurfaceLevel
from stereocell.model.errors import UsageError
from stereocell.model.lattice import Lattice
from stereocell.storage.cache_key import key_of
from stereocell.textures.map_packages import unwrapper_version
from stereocell.transfer.channel_statistics import (
    ChannelStatistics,
)


def run_passes(
    out_folder: OutFolder, plan: Plan, *, engine: Engine, only: str | None
) -> tuple[int, int]:
    """Build the units (or `only` one, `<tile>/<channel>`).

    Returns how many were not done already, and how many others are still to be built.

    Raises SourceError if the source is no longer what was planned, TasksFailedError once all
    others are finished.
    """
    remove_mixed(out_folder, plan)
    wanted = {f"{tile_id}/{channel.id}": channel for tile_id, channel in _select(plan, only)}
    survey = survey_channels(out_folder, plan, engine)
    for labels in plan.labels:
        save_notes(out_folder, plan, labels)
    located = {one.id: locate_objects(out_folder, plan, one, engine) for one in plan.labels}
    tasks: list[tuple[str, UnitTask | ObjectsTask]] = []
    keys, others = {}, 0
    every: list[Iterable[tuple[str, UnitTask | ObjectsTask, str]]] = [
        unit_tasks(out_folder, plan, survey),
        object_tasks(out_folder, plan, located, survey),
    ]
    for name, task, key in chain(*every):
        keys[name] = key
        if is_whole(task.directory):
            continue
        if name in wanted:
            tasks.append((f"{name.split('/')[0]}/{wanted[name].name}", task))
        else:
            others += 1
    if tasks:
        for labels in plan.labels:
            tell_objects(labels, located[labels.id])
    run = partial(engine.run, "units", _run, tasks)
    results = [task.directory for _, task in tasks]
    run_on_input(out_folder, plan, run, results, is_last=True)
    if not others:  # all there: the stage may be made of them
        out_folder.save_units(plan, keys)
    return len(tasks), others


def unit_tasks(
    out_folder: OutFolder, plan: Plan, survey: Survey
) -> Iterator[tuple[str, UnitTask, str]]:
    """Yield `<tile>/<channel>`, task and key of every unit."""
    for tile_id, channel in product((tile.id for tile in plan.tiles), plan.channels):
        statistics = survey[channel.id].statistics
        painter = plan.painter(channel)
        painted = None if painter is None else (painter.index, survey[painter.id].statistics.window)
        level = survey[channel.id].appearance.level
        repair = survey[channel.id].repair
        holder = survey[channel.id].holder
        task, key = _unit_task(
            out_folder,
            plan.with_grid(survey[channel.id].grid_um),
            tile_id,
            channel=channel,
            level=level,
            repair=repair,
            statistics=statistics,
            painted=painted,
            holder=holder,
        )
        yield f"{tile_id}/{channel.id}", task, key


def _run(task: UnitTask | ObjectsTask) -> None:
    if isinstance(task, ObjectsTask):
        run_objects(task)
    else:
        run_unit(task)


def _select(plan: Plan, only: str | None) -> list[tuple[str, Channel | Labels]]:
    every: list[Channel | Labels] = [*plan.channels, *plan.labels]
    wanted = [(tile.id, channel) for tile in plan.tiles for channel in every]
    if only is None:
        return wanted
    chosen = [(t, c) for t, c in wanted if only in {f"{t}/{n}" for n in _names(c)}]
    if not chosen:
        raise UsageError(
            f"--only is {only!r}, expected TILE/CHANNEL with a tile from {plan.tiles[0].id} to "
            f"{plan.tiles[-1].id} and a channel of {', '.join(c.name for c in every)}"
        )
    return chosen


def _names(channel: Channel | Labels) -> tuple[str | int, ...]:
    """Return what a channel may be called; an index is one of the input's."""
    if isinstance(channel, Labels):
        return channel.name, channel.id
    return (channel.name, channel.id) + (() if channel.source else (channel.index,))


def _unit_task(
    out_folder: OutFolder,
    plan: Plan,
    tile_id: str,
    *,
    channel: Channel,
    level: SurfaceLevel | None,
    repair: RepairOptions,
    statistics: ChannelStatistics,
    painted: tuple[int, tuple[float, float]] | None,
    holder: Holder | None,
) -> tuple[UnitTask, str]:
    tile = plan.tile(tile_id)
    own = tile.lattice(plan.region)
    window = own.grown(plan.halo, plan.region)
    given = UnitInput(
        lattice=Lattice(window, own, plan.region, plan.spacing_um, plan.origin_um),
        iso=None if level is None else around(level.field, window),
        background=around(statistics.background, window),
        repair=repair,
        step=plan.step,
        intensity_window=statistics.window,
        settings=plan.settings,
        painted=painted and painted[1],
        holder=holder and holder.around(window),
        max_shift=None if level is None else level.max_shift,
    )
    depends = [
        input_key(plan, channel),
        channel.index,
        [box_to_json(box) for box in (window, own, plan.region)],
        [None if f is None else f.to_json() for f in (given.iso, given.background)],
        given.intensity_window,
        plan.settings.surface.smoothing_um,
        find_wrapper() if plan.settings.surface.wrap == "alpha-wrap" else None,
        unwrapper_version() if plan.settings.unwrap.maps else None,
        plan.settings.surface.closed_tiles,
        [asdict(options) for options in (given.repair, plan.settings.lod)],
        given.step,
        asdict(plan.settings.unwrap),
        plan.settings.volume.bits,
        painted,
        given.holder and given.holder.to_json(),
        given.max_shift,
    ]
    key = key_of(depends, unit_maker, reader_module(plan, channel))
    directory = out_folder.unit_dir(tile_id, channel.id, key)
    ref, index = source_of(plan, channel=channel), painted and painted[0]
    return UnitTask(ref, plan.level_of(channel), channel.index, given, directory, index), key
