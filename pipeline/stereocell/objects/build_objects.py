"""Build the objects of one tile: closed surfaces at several levels of detail, and what is measured.

Objects of other tiles take part where they touch: a wall between two tiles' objects is a wall of
both. Its vertices stay as they are at the finest level, so that both tiles have the same triangles;
further levels are free, since each object is closed by itself.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stereocell.meshes.distance import Nearest, measure_spread
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.spacing import Point, Spacing
from stereocell.model.timing import Clock
from stereocell.objects.options import ObjectOptions
from stereocell.objects.simplify_walls import simplify_walls
from stereocell.objects.walls import (
    Walls,
    extract_walls,
    measure_areas,
    measure_volumes,
    surfaces_of,
)
from stereocell.objects.well_composed import make_well_composed

MARGIN = 2  # voxels of nothing around the labels: see make_well_composed


@dataclass(frozen=True, slots=True)
class BuiltObjects:
    """The objects of a tile, n of them in the order in which they were named.

    lods          finest first; Mesh.objects counts them; none: there are no objects
    volumes_um3   float64 (n,), of their voxels
    areas_um2     float64 (n,), of their surfaces at the finest level
    largest_bias  largest share of an object's volume that a level has more or less, by level
    stopped       levels of which simplifying did not come to an end
    walls         int32 (m, 2): an object, and the number of another one that it touches, in the
                  labels; and `wall_um2` float64 (m,), the area of that wall
    changed       voxels that were changed so that no object touches itself by an edge
    thin          int32 (k,): the objects that can't be built, and are not among the n
    """

    lods: tuple[Lod, ...]
    volumes_um3: NDArray[np.float64]
    areas_um2: NDArray[np.float64]
    largest_bias: tuple[float, ...]
    stopped: tuple[int, ...]
    walls: NDArray[np.int32]
    wall_um2: NDArray[np.float64]
    changed: int
    thin: NDArray[np.int32]


def build_objects(
    labels: NDArray[np.int32],
    owned: NDArray[np.int32],
    *,
    spacing_um: Spacing,
    origin_um: Point,
    step_um: float,
    options: ObjectOptions,
    clock: Clock | None = None,
) -> BuiltObjects:
    """Return the surfaces of some objects of a label map.

    labels     int32 (z, y, x), 0 outside; whatever ends at the array's ends ends there
    owned      int32 (n,), ascending: the objects that are built, each as a whole in the array
    spacing_um, origin_um  (z, y, x), of the voxels and of the centre of the first one
    step_um    of the lattice that vertices lie on

    Objects that are too thin (objects/well_composed.py) are left out.
    """
    clock = clock or Clock()
    with clock("labels mended"):
        padded = np.pad(labels, MARGIN)
        mended, changed, thin = make_well_composed(padded)
        padded[np.isin(padded, thin)] = 0
        thin = np.intersect1d(owned, thin)
        owned = np.setdiff1d(owned, thin)
    z, y, x = (o - MARGIN * s for o, s in zip(origin_um, spacing_um, strict=True))
    with clock("walls"):
        walls = extract_walls(mended, spacing_um, step_um, origin_um=(z, y, x))
        del mended
        walls = _with_owned(walls, owned)
    count = int(padded.max(initial=0)) + 1
    is_owned = np.zeros(count, bool)
    is_owned[owned] = True
    voxels = np.bincount(padded.ravel(), minlength=count)
    volumes = np.where(is_owned, voxels * float(np.prod(spacing_um)), np.nan)
    pairs, wall_um2 = measure_areas(walls)
    mine = np.concatenate([pairs, pairs[:, ::-1]]), np.concatenate([wall_um2, wall_um2])
    kept = is_owned[mine[0][:, 0]]
    touching, areas = mine[0][kept], mine[1][kept]
    place = np.searchsorted(owned, touching[:, 0]).astype(np.int32)
    shared = touching[:, 1] > 0
    lods, biases, stopped = _levels(walls, owned, volumes, min(spacing_um), step_um, options, clock)
    return BuiltObjects(
        lods,
        volumes[owned],
        np.bincount(place, areas, len(owned)).astype(np.float64),
        biases,
        stopped,
        np.stack([place[shared], touching[shared, 1]], axis=1).astype(np.int32),
        areas[shared],
        changed,
        thin,
    )


def _with_owned(walls: Walls, owned: NDArray[np.int32]) -> Walls:
    """Return the walls of the objects that are built; the numbers of vertices stay."""
    kept = np.isin(walls.sides, owned).any(axis=1)
    return replace(walls, triangles=walls.triangles[kept], sides=walls.sides[kept])


def _levels(
    walls: Walls,
    owned: NDArray[np.int32],
    volumes: NDArray[np.float64],
    finest_um: float,
    step_um: float,
    options: ObjectOptions,
    clock: Clock,
) -> tuple[tuple[Lod, ...], tuple[float, ...], tuple[int, ...]]:
    if not len(walls.triangles):
        return (), (), ()
    foreign = (walls.sides > 0) & ~np.isin(walls.sides, owned)
    seam = np.zeros(len(walls.positions), bool)
    seam[walls.triangles[foreign.any(axis=1)]] = True
    with clock("measure"):
        exact = Nearest(_mesh(walls), options.samples)
    lods: list[Lod] = []
    biases, stopped = [], []
    for level, error in enumerate(options.errors):
        with clock("simplify"):
            walls, is_done = simplify_walls(
                walls, error * finest_um, volumes, step_um, locked=seam if level == 0 else None
            )
        if not is_done:
            stopped.append(level)
        with clock("measure"):
            made = Nearest(_mesh(walls), options.samples)
            away, back = measure_spread(exact, made), measure_spread(made, exact)
            distance = max(away.p99, back.p99, lods[-1].distance_um if lods else 0.0)
            largest = max(away.max, back.max, lods[-1].largest_um if lods else 0.0)
            held = measure_volumes(walls, len(volumes) - 1)[owned]
            biases.append(float(np.abs(held / volumes[owned] - 1).max()))
        lods.append(Lod(surfaces_of(walls, owned), distance, farthest_um=largest))
    return tuple(lods), tuple(biases), tuple(stopped)


def _mesh(walls: Walls) -> Mesh:
    """Return all walls as a mesh, each once."""
    used, triangles = np.unique(walls.triangles, return_inverse=True)
    at = walls.positions[used].astype(np.float32)
    return Mesh(at, triangles.reshape(-1, 3).astype(np.uint32), np.zeros_like(at))
