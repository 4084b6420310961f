"""Turn edges so that triangles come out less sharp; vertices and borders stay where they are.

The diagonal of two neighbouring triangles is turned where that makes their smallest angle larger
(Lawson 1972) and the surface moves by less than a bound there: by the distance of the diagonals.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stereocell.certify import Plane, certify, match_edges
from stereocell.mesh import Mesh

SHARP_DEG = 20.0  # triangles that are worth it
ROUNDS = 8
TRIES = 4
GAIN = 1.02  # of the smallest angle: less is not worth a turn
COSINE = 0.7  # between the new triangles and the old two's mean: no folds

Points = NDArray[np.float64]


def turn_edges(mesh: Mesh, planes: tuple[Plane, ...], max_move_um: float) -> Mesh:
    """Return the mesh with edges turned; where that made a fault, it is done again without.

    `planes` are where the mesh may be open. Its number of triangles stays, and so do all its edges
    if the last of TRIES still makes faults.
    """
    positions = mesh.positions.astype(np.float64)
    held = np.zeros(len(positions), bool)
    for _ in range(TRIES):
        triangles = mesh.triangles.astype(np.int64)
        for _ in range(ROUNDS):
            if not _turn(positions, triangles, held, max_move_um):
                break
        turned = replace(mesh, triangles=triangles.astype(np.uint32))
        faults = certify(turned, planes)
        if not faults.total:
            return turned
        held[faults.vertices(triangles)] = True
    return mesh


def _turn(
    positions: Points, triangles: NDArray[np.int64], held: NDArray[np.bool_], max_move_um: float
) -> bool:
    """Turn edges, in place, that have no neighbour of larger gain; return whether there were any.

    Only edges of SHARP triangles, and of none with a vertex that is held.
    """
    angles = _angle(*positions[triangles].transpose(1, 0, 2))
    sharp = angles < np.radians(SHARP_DEG)
    free = np.logical_not(held[triangles].any(axis=1))
    edges, twins, _ = match_edges(triangles)
    near = np.flatnonzero(twins > np.arange(len(twins)))
    far = twins[near]
    wanted = (sharp[near // 3] | sharp[far // 3]) & free[near // 3] & free[far // 3]
    near, far = near[wanted], far[wanted]
    left, right = near // 3, far // 3
    u, v = edges[near].T
    a = triangles[left, (near - 3 * left + 2) % 3]
    b = triangles[right, (far - 3 * right + 2) % 3]
    p, q, r, s = positions[u], positions[v], positions[a], positions[b]
    before = np.minimum(_angle(p, q, r), _angle(q, p, s))
    after = np.minimum(_angle(r, p, s), _angle(s, q, r))
    axis = _unit(np.cross(q - p, r - p) + np.cross(p - q, s - q))
    across = np.cross(q - p, s - r)
    move = np.abs((_unit(across) * (r - p)).sum(axis=1))
    turns = (after > GAIN * before) & (move < max_move_um) & (a != b)
    for normal in (np.cross(p - r, s - r), np.cross(q - s, r - s)):
        turns &= (_unit(normal) * axis).sum(axis=1) > COSINE
    count = len(positions)
    key = np.minimum(a, b) * count + np.maximum(a, b)
    turns &= ~np.isin(key, edges.min(axis=1) * count + edges.max(axis=1))
    chosen = np.flatnonzero(turns)
    chosen = chosen[np.argsort((before - after)[chosen], kind="stable")]
    rank = np.arange(len(chosen))
    first = np.full(len(triangles), len(chosen))
    np.minimum.at(first, left[chosen], rank)
    np.minimum.at(first, right[chosen], rank)
    chosen = chosen[(first[left[chosen]] == rank) & (first[right[chosen]] == rank)]
    _, once = np.unique(key[chosen], return_index=True)
    chosen = chosen[np.sort(once)]
    a, b, u, v = a[chosen], b[chosen], u[chosen], v[chosen]
    triangles[left[chosen]] = np.stack([a, u, b], axis=1)
    triangles[right[chosen]] = np.stack([b, v, a], axis=1)
    return len(chosen) > 0


def _angle(a: Points, b: Points, c: Points) -> NDArray[np.float64]:
    """Return the smallest angle of each triangle, across from its shortest side."""
    sides = [np.linalg.norm(x - y, axis=1) for x, y in ((b, c), (c, a), (a, b))]
    x, y, z = np.sort(np.stack(sides), axis=0)
    cosine = (y**2 + z**2 - x**2) / np.maximum(2 * y * z, 1e-30)
    return np.arccos(np.clip(cosine, -1, 1))


def _unit(vectors: Points) -> Points:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
