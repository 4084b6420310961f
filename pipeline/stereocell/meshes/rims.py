"""Thin out a surface's vertices in the planes where tiles meet, in the same way on both sides.

Simplification must not touch these vertices, because the neighbour has them too, bit by bit. So all
levels share them, and a tile fits its neighbour at any pair of levels. On small tiles they made up
three of five vertices of the coarsest level.

Here both tiles remove the same vertices before levels are made. Each tile extracts the two layers
of cells beside the plane, its own and the neighbour's, and decides on these alone. Voxels and
arithmetic are the same, so the decision is the same. Moves stay inside the two layers, so surfaces
that cross after a move are found there, too.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stereocell.isosurface.extract import extract_surface
from stereocell.kernels.rims import thin_rim
from stereocell.meshes.self_intersections import find_crossings
from stereocell.meshes.simplify import compact, find_planes
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box

# Degrees; smallest allowed angle of a triangle at the plane. Triangles that are sharper already may
# have a third of their smallest angle.
SHARPEST_DEG = 12.0
# Number of tries that keep vertices near crossings, before all vertices of the plane stay
TRIES = 4


def thin_rims(
    mesh: Mesh, distance: NDArray[np.float32], lattice: Lattice, *, error_um: float
) -> Mesh:
    """Return a tile's iso-surface with fewer vertices on its cut planes.

    mesh      as `extract_surface` returns it
    distance  float32 (z, y, x), um; covers `lattice.window`, which reaches past the planes
    error_um  largest distance of a removed vertex from the remaining curve
    """
    target = np.arange(len(mesh.positions))
    for axis, place in lattice.cuts():
        if place in (lattice.region.start[axis], lattice.region.stop[axis] - 1):
            continue  # no other tile follows with the same vertices
        start, stop = list(lattice.own.start), list(lattice.own.stop)
        start[axis], stop[axis] = place - 1, place + 2
        beside = Box((start[0], start[1], start[2]), (stop[0], stop[1], stop[2]))
        layers = extract_surface(distance, replace(lattice, own=beside), cut_as=lattice)
        if not len(layers.triangles):
            continue
        value = np.float32(_plane_um(lattice, axis, place))
        planes = find_planes(layers.positions, lattice.cut_planes())
        moved, onto = _decide(layers, 2 - axis, value, planes, error_um)
        own = np.flatnonzero(mesh.positions[:, 2 - axis] == value)
        known = _keys(mesh.positions[own])
        order = np.argsort(known)
        target[own[order[np.searchsorted(known, moved, sorter=order)]]] = own[
            order[np.searchsorted(known, onto, sorter=order)]
        ]
    if (target == np.arange(len(target))).all():
        return mesh
    triangles = target[mesh.triangles]
    is_left = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return compact(mesh, triangles[is_left].astype(np.uint32))


def _plane_um(lattice: Lattice, axis: int, place: int) -> float:
    """Return the position of a plane along its axis of the world, um."""
    planes = zip(lattice.cuts(), lattice.cut_planes(), strict=True)
    return next(value for cut, (_, value) in planes if cut == (axis, place))


def _decide(
    layers: Mesh, axis: int, value: np.float32, planes: NDArray[np.uint8], error_um: float
) -> tuple[NDArray[np.void], NDArray[np.void]]:
    """Return the keys of vertices that move, and of those onto which they move, (k,) each.

    axis    axis that is normal to the plane, 0: x
    value   position of the plane along the axis, um
    planes  uint8 (n,), a bit for each cut plane that a vertex lies in: where two planes meet, a
            triangle must not come to lie in the other plane
    """
    at = layers.positions.astype(np.float64)
    triangles = np.ascontiguousarray(layers.triangles, np.int32)
    sides = np.sign(layers.positions[:, axis] - value).astype(np.int8)
    sharpest = float(np.cos(np.radians(SHARPEST_DEG)))
    stays = np.zeros(len(at), bool)
    for number in range(TRIES + 1):
        target = thin_rim(at, triangles, sides, planes, stays, error_um, sharpest)
        changed = target[triangles]
        is_left = (changed != np.roll(changed, 1, axis=1)).all(axis=1)
        crossings = find_crossings(at, changed[is_left].astype(np.int64))
        if not len(crossings):
            break
        # Keep all vertices of triangles that touched a vertex now merged into a crossing one.
        at_fault = np.isin(target, changed[is_left][crossings.ravel()])
        stays[triangles[at_fault[triangles].any(axis=1)]] = True
        if number + 1 == TRIES:
            stays[:] = True
    moved = np.flatnonzero(target != np.arange(len(target)))
    return _keys(layers.positions[moved]), _keys(layers.positions[target[moved]])


def _keys(positions: NDArray[np.float32]) -> NDArray[np.void]:
    """Return the bytes of each position (n, 3), which can be sorted and compared."""
    return np.ascontiguousarray(positions).view("V12").ravel()
