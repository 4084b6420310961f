"""Compare the objects of a stage with their label map: voxels are counted anew, surfaces measured.

Of each object its voxels' volume, box and centroid are found again, and the channels' means over it
(not of those that are cut, of which too thin a piece may be left out). The table is joined again.
All is held against the columns in the stage. The volume inside each level's surface may differ from
the voxels' by what the units state. The area of whole objects' finest surfaces is measured again in
the stage, and what is made of area and volume is made anew.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stereocell.building.label_maps import Labels
from stereocell.building.located_objects import CUT, Located, TileGrid, locate, tile_boxes
from stereocell.building.object_passes import images_of, read_notes
from stereocell.building.object_tables import make_table, table_of
from stereocell.building.out_folder import OutFolder
from stereocell.building.plan import Plan
from stereocell.building.tasks.extents import ExtentsTask, find_in_tile
from stereocell.building.tasks.objects import ImageRef, read_on_labels
from stereocell.building.unit_files import load_objects
from stereocell.engine.run import Engine
from stereocell.model.mesh import Mesh
from stereocell.model.object_table import ObjectTable
from stereocell.model.tiling import Box
from stereocell.objects.extents import Runs
from stereocell.objects.table import MEAN
from stereocell.usd.read_objects import TileObjects, read_columns, read_tile_objects
from stereocell.usd.read_stage import loaded, mesh_at, open_stage, read_lods
from stereocell.verify.formats import raise_on

_CLOSE = 1e-4  # share by which a level's volume may exceed what is stated: float32
_SHOWN = 5  # problems of a column
_ROUGH = 0.02  # share of an area that simplifying a voxel's steps may change beside the distance


@dataclass(frozen=True, slots=True)
class _TileTask:
    stage_file: Path
    tile: str
    labels_id: str


@dataclass(frozen=True, slots=True)
class _SumsTask:
    labels: Labels
    box: Box
    images: tuple[ImageRef, ...]


def compare_objects(out_folder: OutFolder, plan: Plan, labels: Labels, engine: Engine) -> str:
    """Return what was compared of a label map. Raises CheckError where something differs."""
    boxes = tile_boxes(TileGrid.of(plan, labels))
    names = [(f"{tile}/{labels.name}", ExtentsTask(labels, box)) for tile, box in boxes.items()]
    counted = engine.run("objects", find_in_tile, names)
    parts = dict(zip(boxes, counted, strict=True))
    located = locate(plan, labels, parts, plan.settings.objects.smallest_voxels)
    index = out_folder.index()
    facts = {
        tile.id: load_objects(
            out_folder.unit_dir(tile.id, labels.id, index[f"{tile.id}/{labels.id}"])
        )
        for tile in plan.tiles
    }
    notes = read_notes(out_folder, plan, labels)
    table, _ = make_table(plan, labels, located, facts, notes, table_of(plan, labels))
    tasks = [(tile.id, _TileTask(out_folder.stage_file, tile.id, labels.id)) for tile in plan.tiles]
    found = engine.run("stage", _read_tile, tasks)
    problems = _odd_means(plan, labels, located, table, engine)
    worst: list[float] = []
    for tile, (there, volumes, area) in zip(plan.tiles, found, strict=True):
        problems += [f"{tile.id}/{labels.id}: {told}" for told in _odd(table, tile.id, there)]
        if there is None or problems:
            continue
        own = facts[tile.id]
        whole = ~np.isin(own.labels, located.extents.labels[located.owners == CUT])
        problems += [f"{tile.id}/{labels.id}: {told}" for told in _odd_areas(there, area, whole)]
        voxels = own.voxels * float(np.prod(labels.spacing_um))
        for level, held in enumerate(volumes):
            bias = float(np.abs(held / voxels - 1).max(initial=0.0))
            worst += [0.0] * (level + 1 - len(worst))
            worst[level] = max(worst[level], bias)
            if bias > own.bias[level] + _CLOSE:
                problems.append(
                    f"{tile.id}/{labels.id}: lod{level}: an object's volume is {bias:.2%} from its "
                    f"voxels', {own.bias[level]:.2%} is stated"
                )
    raise_on(problems)
    told = ", ".join(f"{share:.2%}" for share in worst)
    return (
        f"{len(table.labels)} objects, {len(table.columns)} columns as counted and joined anew; "
        f"volumes of their surfaces by level within {told or 'nothing'}"
    )


def _odd_means(
    plan: Plan, labels: Labels, located: Located, table: ObjectTable, engine: Engine
) -> list[str]:
    """Return which means of a channel over an object are others than those of its voxels."""
    images = images_of(plan)
    boxes = tile_boxes(located.grid).items()
    tasks = [(f"{tile}/{labels.name}", _SumsTask(labels, box, images)) for tile, box in boxes]
    whole = located.extents.labels[located.owners != CUT]
    voxels, sums = np.zeros(len(whole)), np.zeros((len(whole), len(images)))
    for names, counts, totals in engine.run("intensities", _sum_up, tasks) if images else []:
        _, place, found = np.intersect1d(whole, names, return_indices=True)
        voxels[place] += counts[found]
        sums[place] += totals[found]
    _, place, rows = np.intersect1d(whole, table.labels, return_indices=True)
    means = sums[place] / np.maximum(voxels[place], 1)[:, np.newaxis]
    columns = [column for column in table.columns if column.id.startswith(MEAN)][: len(images)]
    problems = []
    for column, expected in zip(columns, means.T, strict=True):
        same = np.isclose(column.values[rows], expected, rtol=1e-4, atol=1e-6, equal_nan=True)
        if not same.all():
            shown = ", ".join(map(str, whole[place][~same][:_SHOWN].tolist()))
            problems.append(f"{labels.id}: column {column.id} is not the voxels' mean of {shown}")
    return problems


def _sum_up(
    task: _SumsTask,
) -> tuple[NDArray[np.uint64], NDArray[np.int64], NDArray[np.float64]]:
    """Return the labels of a box (n,), their voxels (n,) and sums of intensities (n, images)."""
    if 0 in task.box.shape:
        return np.zeros(0, np.uint64), np.zeros(0, np.int64), np.zeros((0, len(task.images)))
    runs = Runs.of(task.labels.open().read(task.box))
    names, place = np.unique(runs.values, return_inverse=True)
    sums = np.zeros((len(names), len(task.images)))
    for index, image in enumerate(task.images):
        voxels = read_on_labels(task.labels, task.box, image).ravel().astype(np.float64)
        sums[:, index] = np.bincount(place, np.add.reduceat(voxels, runs.starts), len(names))
    counts = np.bincount(place, runs.lengths, len(names))
    return names.astype(np.uint64), counts.astype(np.int64), sums


def _odd(table: ObjectTable, tile: str, there: TileObjects | None) -> list[str]:
    """Return what differs between a tile's objects in the stage and the table."""
    own = table.of_tile(tile)
    if there is None:
        return [f"the stage has no objects, expected {len(own.labels)}"] if len(own.labels) else []
    if there.labels.tolist() != own.labels.tolist():
        return [
            f"the stage has {len(there.labels)} objects, others than the {len(own.labels)} found"
        ]
    found = []
    for column in own.columns:
        values = there.values.get(column.id)
        if values is None:
            found.append(f"column {column.id} is missing")
            continue
        same = np.isclose(values, column.values, rtol=1e-5, atol=1e-6, equal_nan=True)
        if not same.all():
            shown = ", ".join(map(str, own.labels[~same][:_SHOWN].tolist()))
            found.append(f"column {column.id} has other values of {shown}")
    return found


def _odd_areas(
    there: TileObjects, area: tuple[NDArray[np.float64], float], whole: NDArray[np.bool_]
) -> list[str]:
    """Return which areas of whole objects are others than those of their surfaces.

    area  of each object's finest surface in the stage, um^2, and how far it lies, um, from the one
          that was measured: a ball whose skin moves by d has 2 d / r more
    """
    measured, distance_um = area
    stated = there.values["area_um2"].astype(np.float64)
    volume = there.values["volume_um3"].astype(np.float64)
    radius = np.cbrt(3 * volume / (4 * np.pi))
    off = np.abs(measured - stated) > (2 * distance_um / radius + _ROUGH) * stated
    round_area = 4 * np.pi * radius**2
    uneven = ~np.isclose(there.values["sphericity"] * stated, round_area, rtol=1e-4)
    found = []
    for column, odd in (("area_um2", off & whole), ("sphericity", uneven & (stated > 0))):
        if odd.any():
            shown = ", ".join(map(str, there.labels[odd][:_SHOWN].tolist()))
            found.append(f"column {column} is not that of the surface of {shown}")
    return found


def _read_tile(
    task: _TileTask,
) -> tuple[TileObjects | None, list[NDArray[np.float64]], tuple[NDArray[np.float64], float]]:
    """Return a tile's objects in the stage, their volumes by level, um^3, and `_odd_areas`'."""
    stage = open_stage(task.stage_file)
    described = read_columns(stage, task.labels_id)
    with loaded(stage, task.tile) as (tile, _):
        prim = mesh_at(tile, task.labels_id, 0)
        there = None if prim is None or described is None else read_tile_objects(prim, described[0])
        if there is None:
            return None, [], (np.zeros(0), 0.0)
        count = len(there.labels)
        lods = list(read_lods(tile, task.labels_id))
        area = _areas(lods[0].mesh, count), lods[0].largest_um
        return there, [_volumes(lod.mesh, count) for lod in lods], area


def _areas(mesh: Mesh, count: int) -> NDArray[np.float64]:
    """Return the area of each object's surface, um^2, float64 (n,)."""
    if mesh.objects is None:
        return np.zeros(count)
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    parts = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return np.bincount(mesh.objects[mesh.triangles[:, 0]], parts, count).astype(np.float64)


def _volumes(mesh: Mesh, count: int) -> NDArray[np.float64]:
    """Return the volume inside each object's surface, um^3, float64 (n,)."""
    if mesh.objects is None:
        return np.zeros(count)
    at = mesh.positions.astype(np.float64) - mesh.positions.mean(axis=0)
    a, b, c = (at[mesh.triangles[:, k]] for k in range(3))
    parts = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    return np.bincount(mesh.objects[mesh.triangles[:, 0]], parts, count).astype(np.float64)
