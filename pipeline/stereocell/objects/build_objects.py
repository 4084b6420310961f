"""Build the objects of one tile: closed surfaces at several levels of detail, and measurements.

Objects of other tiles are included where they touch: an interface between objects of two tiles
belongs to both tiles. Its vertices stay fixed at the finest level, so that both tiles have the same
triangles. They are free at further levels, because each object is closed by itself.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stereocell.meshes.distance import Nearest, measure_spread
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.spacing import Point, Spacing
from stereocell.model.timing import Clock
from stereocell.objects.interfaces import (
    Interfaces,
    extract_interfaces,
    measure_areas,
    measure_volumes,
    surfaces_of,
)
from stereocell.objects.options import ObjectOptions
from stereocell.objects.simplify_interfaces import simplify_interfaces
from stereocell.objects.well_composed import make_well_composed

MARGIN = 2  # empty voxels around the labels, see make_well_composed


@dataclass(frozen=True, slots=True)
class BuiltObjects:
    """The objects of a tile, n of them in the order of `owned`.

    lods           finest first; `Mesh.objects` holds indices of objects; empty without objects
    volumes_um3    float64 (n,), volumes of their voxels
    areas_um2      float64 (n,), areas of their surfaces at the finest level
    largest_bias   for each level, the largest relative error of an object's volume
    stopped        numbers of the levels of detail at which simplification stopped early
    interfaces     int32 (m, 2): an object's index, and the label of another object that it touches
    interface_um2  float64 (m,), area of that interface
    changed        number of voxels that were changed so that no object touches itself by an edge
    thin           int32 (k,), objects that are too thin to be built; they are not among the n
    """

    lods: tuple[Lod, ...]
    volumes_um3: NDArray[np.float64]
    areas_um2: NDArray[np.float64]
    largest_bias: tuple[float, ...]
    stopped: tuple[int, ...]
    interfaces: NDArray[np.int32]
    interface_um2: NDArray[np.float64]
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

    labels     int32 (z, y, x), 0 outside; objects are closed at the array's ends
    owned      int32 (n,), rising: objects that are built, each completely within the array
    spacing_um, origin_um  voxel spacing, and centre of the first voxel, (z, y, x)
    step_um    step of the lattice on which vertices lie
    clock      measures the time of each part of the work

    Objects that are too thin are left out, see objects/well_composed.py.
    """
    clock = clock or Clock()
    with clock("labels mended"):
        padded = np.pad(labels, MARGIN)
        mended, changed, thin = make_well_composed(padded)
        padded[np.isin(padded, thin)] = 0
        thin = np.intersect1d(owned, thin)
        owned = np.setdiff1d(owned, thin)
    z, y, x = (o - MARGIN * s for o, s in zip(origin_um, spacing_um, strict=True))
    with clock("interfaces"):
        interfaces = extract_interfaces(mended, spacing_um, step_um, origin_um=(z, y, x))
        del mended
        interfaces = _with_owned(interfaces, owned)
    count = int(padded.max(initial=0)) + 1
    is_owned = np.zeros(count, bool)
    is_owned[owned] = True
    voxels = np.bincount(padded.ravel(), minlength=count)
    volumes = np.where(is_owned, voxels * float(np.prod(spacing_um)), np.nan)
    pairs, interface_um2 = measure_areas(interfaces)
    mine = np.concatenate([pairs, pairs[:, ::-1]]), np.concatenate([interface_um2, interface_um2])
    kept = is_owned[mine[0][:, 0]]
    touching, areas = mine[0][kept], mine[1][kept]
    place = np.searchsorted(owned, touching[:, 0]).astype(np.int32)
    shared = touching[:, 1] > 0
    lods, biases, stopped = _levels(
        interfaces, owned, volumes, min(spacing_um), step_um, options, clock
    )
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


def _with_owned(interfaces: Interfaces, owned: NDArray[np.int32]) -> Interfaces:
    """Return the interfaces of objects that are built. Vertices keep their indices."""
    kept = np.isin(interfaces.sides, owned).any(axis=1)
    return replace(interfaces, triangles=interfaces.triangles[kept], sides=interfaces.sides[kept])


def _levels(
    interfaces: Interfaces,
    owned: NDArray[np.int32],
    volumes: NDArray[np.float64],
    finest_um: float,
    step_um: float,
    options: ObjectOptions,
    clock: Clock,
) -> tuple[tuple[Lod, ...], tuple[float, ...], tuple[int, ...]]:
    if not len(interfaces.triangles):
        return (), (), ()
    foreign = (interfaces.sides > 0) & ~np.isin(interfaces.sides, owned)
    seam = np.zeros(len(interfaces.positions), bool)
    seam[interfaces.triangles[foreign.any(axis=1)]] = True
    with clock("measure"):
        exact = Nearest(_mesh(interfaces), options.samples)
    lods: list[Lod] = []
    biases, stopped = [], []
    for level, error in enumerate(options.errors):
        with clock("simplify"):
            interfaces, is_done = simplify_interfaces(
                interfaces, error * finest_um, volumes, step_um, locked=seam if level == 0 else None
            )
        if not is_done:
            stopped.append(level)
        with clock("measure"):
            made = Nearest(_mesh(interfaces), options.samples)
            away, back = measure_spread(exact, made), measure_spread(made, exact)
            distance = max(away.p99, back.p99, lods[-1].distance_um if lods else 0.0)
            largest = max(away.max, back.max, lods[-1].largest_um if lods else 0.0)
            held = measure_volumes(interfaces, len(volumes) - 1)[owned]
            biases.append(float(np.abs(held / volumes[owned] - 1).max()))
        lods.append(Lod(surfaces_of(interfaces, owned), distance, farthest_um=largest))
    return tuple(lods), tuple(biases), tuple(stopped)


def _mesh(interfaces: Interfaces) -> Mesh:
    """Return all interfaces as one mesh, each of them once."""
    used, triangles = np.unique(interfaces.triangles, return_inverse=True)
    at = interfaces.positions[used].astype(np.float32)
    return Mesh(at, triangles.reshape(-1, 3).astype(np.uint32), np.zeros_like(at))
