"""The two rounds over the units: first what neighbours must agree on, then the units themselves.

Round one finds each channel's window, dataset-wide, and an iso-value for each (tile, channel).
Round two builds meshes and volumes. Every result lies under a name that says what it depends on.
"""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stereocell import isofield, isovalue, lod, repair, surface, survey, unit, unwrap
from stereocell.config import Settings
from stereocell.engine import Engine
from stereocell.errors import NoSurfaceError, UsageError
from stereocell.isofield import make_iso_field
from stereocell.isovalue import find_iso_value
from stereocell.plan import Channel, Plan
from stereocell.read import Dataset
from stereocell.sources import SourceRef, open_source, source_of
from stereocell.store import Store, is_whole, key_of, read_json, save_unit, write_json
from stereocell.surface import smooth
from stereocell.survey import Display, find_display, make_look
from stereocell.tiling import Box
from stereocell.unit import UnitInput, build_unit

SURVEY_VOXELS = 16_000_000  # a channel's window is found on at most about so many


def run_rounds(store: Store, plan: Plan, engine: Engine, only: str | None) -> int:
    """Build the units (or `only` one, `<tile>/<channel>`); return how many were not done already.

    Raises TasksFailedError once all others are finished.
    """
    wanted = {(tile_id, channel.id) for tile_id, channel in _select(plan, only)}
    content = _survey(store, plan, engine)
    tasks, keys, others = [], {}, 0
    for tile_id, channel in _select(plan, None):
        task, key = _unit_task(store, plan, content, tile_id, channel)
        keys[f"{tile_id}/{channel.id}"] = key
        if is_whole(task.directory):
            continue
        if (tile_id, channel.id) in wanted:
            tasks.append((f"{tile_id}/{channel.name}", task))
        else:
            others += 1
    if tasks:
        engine.run("units", run_unit, tasks)
    if not others:  # all there: the stage may be made of them
        if not store.index_file.exists() or store.index() != keys:
            write_json(store.index_file, keys)
        store.sign_units(plan)
    return len(tasks)


def _select(plan: Plan, only: str | None) -> list[tuple[str, Channel]]:
    wanted = [(tile.id, channel) for tile in plan.tiles for channel in plan.channels]
    if only is None:
        return wanted
    chosen = [(t, c) for t, c in wanted if only in (f"{t}/{c.name}", f"{t}/{c.id}")]
    if not chosen:
        raise UsageError(
            f"--only is {only!r}, expected TILE/CHANNEL with a tile from {plan.tiles[0].id} to "
            f"{plan.tiles[-1].id} and a channel of {', '.join(c.name for c in plan.channels)}"
        )
    return chosen


@dataclass(frozen=True, slots=True)
class DisplayTask:
    ref: SourceRef
    level: int
    channel: int
    region: Box
    settings: Settings


@dataclass(frozen=True, slots=True)
class IsoTask:
    ref: SourceRef
    level: int
    channel: int
    box: Box
    settings: Settings
    given: float | None
    file: Path


@dataclass(frozen=True, slots=True)
class UnitTask:
    ref: SourceRef
    level: int
    channel: int
    given: UnitInput
    directory: Path


def run_display(task: DisplayTask) -> Display:
    """Return a channel's window and histogram, from a coarse level or from some of the planes."""
    dataset = open_source(task.ref)
    level = task.level
    # the finest level that is small enough; a source without one gives every k-th plane
    while level + 1 < len(dataset.levels) and _voxels(task, dataset, level) > SURVEY_VOXELS:
        level += 1
    box = _region_at(task, dataset, level)
    step = -(-int(np.prod(box.shape, dtype=np.int64)) // SURVEY_VOXELS)
    planes = range(box.start[0], box.stop[0], step)
    voxels = np.concatenate(
        [
            dataset.read(
                task.channel, Box((z, *box.start[1:]), (z + 1, *box.stop[1:])), level
            ).voxels
            for z in planes
        ]
        if step > 1
        else [dataset.read(task.channel, box, level).voxels]
    )
    return find_display(voxels, task.settings.window)


def _voxels(task: DisplayTask, dataset: Dataset, level: int) -> int:
    return int(np.prod(_region_at(task, dataset, level).shape, dtype=np.int64))


def _region_at(task: DisplayTask, dataset: Dataset, level: int) -> Box:
    """Return the region in voxels of a coarser level."""
    fine, coarse = dataset.levels[task.level].shape, dataset.levels[level].shape
    start = [a * n // m for a, n, m in zip(task.region.start, coarse, fine, strict=True)]
    stop = [-(-b * n // m) for b, n, m in zip(task.region.stop, coarse, fine, strict=True)]
    z0, y0, x0 = start
    z1, y1, x1 = (max(b, a + 1) for a, b in zip(start, stop, strict=True))
    return Box((z0, y0, x0), (z1, y1, x1))


def run_iso(task: IsoTask) -> dict[str, Any]:
    """Find one unit's iso-value and write it down with its curve."""
    volume = open_source(task.ref).read(task.channel, task.box, task.level)
    field = smooth(volume, float(task.settings.surface.smoothing_um))
    result: dict[str, Any] = {"value": None, "confidence": 0.0, "reason": ""}
    options = task.settings.isovalue
    try:
        found = find_iso_value(field, volume.spacing_um, options)
    except NoSurfaceError as error:
        result["reason"] = str(error)
    else:
        result["found"], result["confidence"] = found.value, found.confidence
        if found.is_clear:
            result["value"] = found.value
        else:
            result["reason"] = (
                f"no clear surface: the gradient at {found.value:.5g} is {found.sharpness:.2f} "
                f"times the tile's median, expected at least {options.min_sharpness:g}"
            )
        result["levels"] = [float(f"{v:.6g}") for v in found.levels]
        result["score"] = [round(float(v), 5) for v in found.score]
    if task.given is not None and "found" in result:
        result["value"], result["reason"] = task.given, ""
    write_json(task.file, result)
    return result


def run_unit(task: UnitTask) -> dict[str, Any]:
    """Build one unit and write it down."""
    start = time.perf_counter()
    volume = open_source(task.ref).read(task.channel, task.given.window, task.level)
    seconds = time.perf_counter() - start
    built = build_unit(volume, task.given)
    return save_unit(task.directory, replace(built, seconds={"read": seconds, **built.seconds}))


def _survey(store: Store, plan: Plan, engine: Engine) -> dict[str, Any]:
    """Return (and write) each channel's display, iso-values and transfer functions."""
    displays = _displays(store, plan, engine)
    isos = _isos(store, plan, engine)
    content = {}
    for channel in plan.channels:
        found = {tile.id: isos[tile.id, channel.id] for tile in plan.tiles}
        display = displays[channel.id]
        look = make_look(
            channel.name,
            channel.color,
            display,
            {tile: f["value"] for tile, f in found.items()},
            {tile: f["confidence"] for tile, f in found.items()},
        )
        content[channel.id] = {
            "display": asdict(display),
            "iso": {
                tile: {key: f[key] for key in ("value", "confidence", "reason")}
                | {"file": f["file"]}
                for tile, f in found.items()
            },
            "look": asdict(look),
        }
    write_json(store.survey_file, content)
    return content


def _displays(store: Store, plan: Plan, engine: Engine) -> dict[str, Display]:
    files, tasks = {}, []
    for channel in plan.channels:
        depends = [_input_key(plan), channel.index, _box(plan.region), asdict(plan.settings.window)]
        key = key_of(depends, survey)
        files[channel.id] = store.out / "units" / f"window-{channel.id}-{key}.json"
        if not files[channel.id].is_file():
            task = DisplayTask(
                source_of(plan), plan.level, channel.index, plan.region, plan.settings
            )
            tasks.append((channel.id, task))
    if tasks:
        displays = engine.run("windows", run_display, tasks)
        for (channel_id, _), display in zip(tasks, displays, strict=True):
            write_json(files[channel_id], asdict(display))
    found = {}
    for channel_id, file in files.items():
        content = read_json(file, "run `stereocell units OUT` again")
        found[channel_id] = Display(tuple(content["window"]), tuple(content["histogram"]))
    return found


def _isos(store: Store, plan: Plan, engine: Engine) -> dict[tuple[str, str], dict[str, Any]]:
    files, tasks = {}, []
    settings, ref = plan.settings, source_of(plan)
    for tile in plan.tiles:
        for channel in plan.channels:
            given = settings.iso_values.get(channel.name)
            depends = [
                _input_key(plan),
                channel.index,
                _box(tile.box),
                asdict(settings.isovalue),
                settings.surface.smoothing_um,
                given,
            ]
            file = store.iso_file(tile.id, channel.id, key_of(depends, isovalue, surface))
            files[tile.id, channel.id] = file
            if not file.is_file():
                task = IsoTask(ref, plan.level, channel.index, tile.box, settings, given, file)
                tasks.append((f"{tile.id}/{channel.name}", task))
    if tasks:
        engine.run("iso-values", run_iso, tasks)
    remedy = "run `stereocell units OUT` again"
    return {
        unit_: read_json(file, remedy) | {"file": file.relative_to(store.out).as_posix()}
        for unit_, file in files.items()
    }


def _unit_task(
    store: Store, plan: Plan, content: Mapping[str, Any], tile_id: str, channel: Channel
) -> tuple[UnitTask, str]:
    tile = plan.tile(tile_id)
    entry = content[channel.id]
    iso = make_iso_field(plan.tiles, {t: f["value"] for t, f in entry["iso"].items()})
    low, high = entry["display"]["window"]
    lattice = tile.lattice(plan.region)
    window = lattice.grown(plan.halo, plan.region)
    given = UnitInput(
        window=window,
        lattice=lattice,
        region=plan.region,
        iso=None if iso is None else iso.around(window),
        display=(low, high),
        settings=plan.settings,
    )
    depends = [
        _input_key(plan),
        channel.index,
        [_box(box) for box in (given.window, given.lattice, given.region)],
        None if given.iso is None else [given.iso.centres, given.iso.values.tolist()],
        given.display,
        [asdict(options) for options in (plan.settings.surface, plan.settings.lod)],
        asdict(plan.settings.unwrap),
    ]
    key = key_of(depends, unit, surface, repair, lod, unwrap, isofield)
    directory = store.unit_dir(tile_id, channel.id, key)
    return UnitTask(source_of(plan), plan.level, channel.index, given, directory), key


def _input_key(plan: Plan) -> list[Any]:
    return [plan.fingerprint, plan.level, plan.spacing_um, plan.origin_um, plan.settings.plan.time]


def _box(box: Box) -> list[list[int]]:
    return [list(box.start), list(box.stop)]
