"""Compare the objects of a stage with their label map, by counting voxels and measuring surfaces.

The volume, box and centroid of each object are computed again from the label map, and the channels'
means over it from the images. A 95th percentile is accepted if the right numbers of voxels lie
below and above it. Objects that are cut are excluded from intensities, since thin pieces of them
may be left out. The object table is joined again. All results are compared with the columns in the
stage.

The volume inside each level's surface may differ from the voxels' volume by as much as the units
state. The area of whole objects' finest surfaces is measured again in the stage, and columns that
derive from area and volume are computed again. The same holds for interfaces: their areas, and the
pairs of objects that share one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stereocell.building.object_records import read_notes
from stereocell.building.out_folder import OutFolder
from stereocell.engine.run import Engine
from stereocell.model.mesh import Mesh
from stereocell.model.object_table import ObjectTable
from stereocell.model.tiling import Box
from stereocell.objects.extents import Runs
from stereocell.objects.intensities import PERCENTILE
from stereocell.objects.table import MEAN, P95
from stereocell.planning.located_objects import CUT, Located, TileGrid, locate, tile_boxes
from stereocell.planning.object_steps import images_of
from stereocell.planning.object_tables import make_table, table_of
from stereocell.planning.plan import Plan
from stereocell.steps.build_objects import Image, read_on_labels
from stereocell.steps.find_extents import FindExtents
from stereocell.steps.labels import Labels
from stereocell.steps.unit_files import load_objects
from stereocell.usd.read_levels import mesh_at, read_lods
from stereocell.usd.read_objects import TileObjects, read_columns, read_tile_objects
from stereocell.usd.read_stage import loaded, open_stage
from stereocell.verify.check_line import raise_on
from stereocell.verify.shared_interfaces import (
    NO_SURFACES,
    Surfaces,
    find_surfaces,
    join_surfaces,
)

_CLOSE = 1e-4  # share by which values may differ beyond the stated tolerance, due to float32
_SHOWN = 5  # most objects that a problem of a column names
_ROUGH = 0.02  # share by which simplifying may change an area in addition to the stated distance


@dataclass(frozen=True, slots=True)
class _TileTask:
    stage_file: Path
    tile: str
    labels_id: str
    beyond: NDArray[np.float32]  # boxes of other tiles' objects; see find_surfaces


@dataclass(frozen=True, slots=True)
class _SumsTask:
    labels: Labels
    box: Box
    images: tuple[Image, ...]
    names: NDArray[np.uint64]  # labels of whole objects, ascending
    p95s: NDArray[np.float64]  # (n, images), percentiles to compare with the objects' voxels


def compare_objects(out_folder: OutFolder, plan: Plan, labels: Labels, engine: Engine) -> str:
    """Compare a label map's objects with the source; return a line on the compared parts.

    Raises CheckError if they differ.
    """
    boxes = tile_boxes(TileGrid.of(plan, labels))
    steps = [
        (f"{tile}/{labels.name}", FindExtents(labels.voxels, box)) for tile, box in boxes.items()
    ]
    counted = engine.run("objects", FindExtents.run, steps)
    parts = dict(zip(boxes, counted, strict=True))
    located = locate(plan, labels, parts, plan.settings.objects.smallest_voxels)
    index = out_folder.index()
    facts = {
        tile.id: load_objects(out_folder.unit_dir(name, index[name]))
        for tile in plan.tiles
        for name in [f"{tile.id}/{labels.id}"]
    }
    notes = read_notes(out_folder, plan, labels)
    table, _ = make_table(plan, labels, located, facts, notes, table_of(plan, labels))
    beyond = _boxes_beyond(table, max(labels.spacing_um))
    tasks = [
        (tile.id, _TileTask(out_folder.stage_file, tile.id, labels.id, beyond[tile.id]))
        for tile in plan.tiles
    ]
    found = engine.run("stage", _read_tile, tasks)
    problems = _odd_intensities(plan, labels, located, table, engine)
    cut = located.extents.labels[located.owners == CUT]
    problems += _odd_interfaces(labels, table, [tile[2:] for tile in found], cut)
    worst: list[float] = []
    for tile, (there, volumes, surfaces, largest_um) in zip(plan.tiles, found, strict=True):
        problems += [f"{tile.id}/{labels.id}: {one}" for one in _odd(table, tile.id, there)]
        if there is None or problems:
            continue
        own = facts[tile.id]
        whole = ~np.isin(own.labels, cut)
        areas = surfaces.area_um2, largest_um
        problems += [f"{tile.id}/{labels.id}: {one}" for one in _odd_areas(there, areas, whole)]
        voxels = own.voxels * float(np.prod(labels.spacing_um))
        for level, held in enumerate(volumes):
            bias = float(np.abs(held / voxels - 1).max(initial=0.0))
            worst += [0.0] * (level + 1 - len(worst))
            worst[level] = max(worst[level], bias)
            if bias > own.bias[level] + _CLOSE:
                problems.append(
                    f"{tile.id}/{labels.id}: lod{level}: the volume of an object differs by "
                    f"{bias:.2%} from its voxels, expected at most {own.bias[level]:.2%} as stated"
                )
    raise_on(problems)
    biases = ", ".join(f"{share:.2%}" for share in worst)
    return (
        f"{len(table.labels)} objects, {len(table.columns)} columns equal to a new count and join; "
        f"volumes of their surfaces, from lod0 on, within {biases or 'nothing'}"
    )


def _boxes_beyond(table: ObjectTable, margin_um: float) -> dict[str, NDArray[np.float32]]:
    """Return, for each tile, the boxes (n, 6) around the other tiles' objects, with a margin."""
    boxes = {
        tile: np.concatenate(
            [
                table.boxes[rows, :3].min(axis=0) - margin_um,
                table.boxes[rows, 3:].max(axis=0) + margin_um,
            ]
        )
        for tile, rows in table.rows.items()
        if len(rows)
    }
    return {
        tile: np.array([box for other, box in boxes.items() if other != tile]).reshape(-1, 6)
        for tile in table.rows
    }


def _odd_interfaces(
    labels: Labels,
    table: ObjectTable,
    tiles: Sequence[tuple[Surfaces, float]],
    cut: NDArray[np.uint64],
) -> list[str]:
    """Return problems of objects whose neighbours or interfaces differ from their surfaces.

    tiles  for each tile, the surfaces in the stage and their largest distance, um, from the
           surfaces that were measured
    cut    labels of objects that are cut, whose surfaces include the planes of the cut
    """
    shared, pairs = join_surfaces([surfaces for surfaces, _ in tiles])
    touching = dict(zip(*np.unique(pairs, return_counts=True), strict=True))
    odd: dict[str, list[int]] = {"neighbours": [], "contact": []}
    row_of = {label: row for row, label in enumerate(table.labels.tolist())}
    known = {column.id: column.values for column in table.columns}
    for (surfaces, largest_um), interfaces_um2 in zip(tiles, shared, strict=True):
        rows = np.array([row_of.get(label, -1) for label in surfaces.labels.tolist()], np.int64)
        there = rows >= 0  # `_odd` reports the other objects
        names, rows = surfaces.labels[there], rows[there]
        counts = np.array([touching.get(name, 0) for name in names])
        odd["neighbours"] += names[known["neighbours"][rows] != counts].tolist()
        radius = np.cbrt(3 * known["volume_um3"][rows] / (4 * np.pi))
        most = 2 * largest_um / radius + _ROUGH
        share = interfaces_um2[there] / np.maximum(surfaces.area_um2[there], 1e-12)
        off = np.abs(known["contact"][rows] - share) > most
        odd["contact"] += names[off & ~np.isin(names, cut)].tolist()
    return [
        f"{labels.id}: column {column} differs from the surfaces of {_shown(found)}"
        for column, found in odd.items()
        if found
    ]


def _shown(names: Sequence[int]) -> str:
    return ", ".join(map(str, sorted(set(names))[:_SHOWN]))


def _odd_intensities(
    plan: Plan, labels: Labels, located: Located, table: ObjectTable, engine: Engine
) -> list[str]:
    """Return problems of intensities that differ from the means and percentiles of the voxels."""
    images = images_of(plan)
    if not images:
        return []
    whole = located.extents.labels[located.owners != CUT]
    names, _, rows = np.intersect1d(whole, table.labels, return_indices=True)
    means, p95s = (
        [column for column in table.columns if column.id.startswith(start)][: len(images)]
        for start in (MEAN, P95)
    )
    stated = np.stack([column.values[rows] for column in p95s], axis=1).astype(np.float64)
    tasks = [
        (f"{tile}/{labels.name}", _SumsTask(labels, box, images, names, stated))
        for tile, box in tile_boxes(located.grid).items()
    ]
    voxels, totals = np.zeros(len(names), np.int64), np.zeros((3, len(names), len(images)))
    for counts, found in engine.run("intensities", _sum_up, tasks):
        voxels += counts
        totals += found
    sums, below, up_to = totals
    expected = sums / np.maximum(voxels, 1)[:, np.newaxis]
    # The percentile lies between the two voxels next to its rank.
    at = PERCENTILE / 100 * (voxels - 1)[:, np.newaxis]
    is_p95 = (below <= np.ceil(at)) & (up_to >= np.floor(at) + 1)
    problems = []
    for index, (mean, p95) in enumerate(zip(means, p95s, strict=True)):
        values = mean.values[rows]
        same = np.isclose(values, expected[:, index], rtol=1e-4, atol=1e-6, equal_nan=True)
        for column, kind, right in ((mean, "mean", same), (p95, "p95", is_p95[:, index])):
            if not right.all():
                shown = _shown(names[~right].tolist())
                problems.append(
                    f"{labels.id}: column {column.id} differs from the {kind} of the voxels of "
                    f"{shown}"
                )
    return problems


def _sum_up(task: _SumsTask) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return counts and sums of intensity over objects' voxels in a box.

    The first array (n,) has the number of each object's voxels. The second (3, n, images) has the
    sum of intensities, the number below the object's p95, and the number not above it.
    """
    count = len(task.names)
    totals = np.zeros((3, count, len(task.images)))
    if 0 in task.box.shape or not count:
        return np.zeros(count, np.int64), totals
    runs = Runs.of(task.labels.open().read(task.box))
    values = runs.values.astype(np.uint64)
    place = np.searchsorted(task.names, values).clip(0, count - 1)
    place[task.names[place] != values] = count  # an extra place for objects that are not compared
    for index, image in enumerate(task.images):
        voxels = read_on_labels(task.labels, task.box, image).ravel().astype(np.float64)
        p95s = np.append(task.p95s[:, index], np.nan)[place]
        near = np.abs(p95s) * _CLOSE  # tolerance for the rounding to float32
        less = voxels < np.repeat(p95s - near, runs.lengths)
        not_more = voxels <= np.repeat(p95s + near, runs.lengths)
        for total, what in zip(totals, (voxels, less, not_more), strict=True):
            added = np.add.reduceat(what.astype(np.float64), runs.starts)
            total[:, index] = np.bincount(place, added, count + 1)[:count]
    counts = np.bincount(place, runs.lengths, count + 1)[:count]
    return counts.astype(np.int64), totals


def _odd(table: ObjectTable, tile: str, there: TileObjects | None) -> list[str]:
    """Return the differences between a tile's objects in the stage and in the table."""
    own = table.of_tile(tile)
    if there is None:
        return [f"the stage has no objects, expected {len(own.labels)}"] if len(own.labels) else []
    if there.labels.tolist() != own.labels.tolist():
        return [
            f"found {len(there.labels)} objects in the stage, expected the {len(own.labels)} "
            "objects of the label map"
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
            found.append(f"column {column.id} has other values for the objects {shown}")
    return found


def _odd_areas(
    there: TileObjects, area: tuple[NDArray[np.float64], float], whole: NDArray[np.bool_]
) -> list[str]:
    """Return problems of areas that differ from those of whole objects' surfaces.

    area  area of each object's finest surface in the stage, um^2, and the surface's distance, um,
          from the one that was measured

    The tolerance follows from a ball: if its surface moves by d, its area changes by a share of
    2 d / r.
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
            found.append(f"column {column} differs from the surfaces of {shown}")
    return found


def _read_tile(
    task: _TileTask,
) -> tuple[TileObjects | None, list[NDArray[np.float64]], Surfaces, float]:
    """Read the objects of a label map in one tile of the stage, and measure their surfaces.

    Returns the objects, their volumes by level (um^3), their finest surfaces, and the largest
    distance of those (um) from the surfaces that were measured.
    """
    stage = open_stage(task.stage_file)
    described = read_columns(stage, task.labels_id)
    with loaded(stage, task.tile) as (tile, _):
        prim = mesh_at(tile, task.labels_id, 0)
        there = None if prim is None or described is None else read_tile_objects(prim, described[0])
        if there is None:
            return None, [], NO_SURFACES, 0.0
        lods = list(read_lods(tile, task.labels_id))
        surfaces = find_surfaces(lods[0].mesh, there.labels, task.beyond)
        volumes = [_volumes(lod.mesh, len(there.labels)) for lod in lods]
        return there, volumes, surfaces, lods[0].largest_um


def _volumes(mesh: Mesh, count: int) -> NDArray[np.float64]:
    """Return the volume inside each object's surface, um^3, float64 (n,)."""
    if mesh.objects is None:
        return np.zeros(count)
    at = mesh.positions.astype(np.float64) - mesh.positions.mean(axis=0)
    a, b, c = (at[mesh.triangles[:, k]] for k in range(3))
    parts = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    return np.bincount(mesh.objects[mesh.triangles[:, 0]], parts, count).astype(np.float64)
