"""Split the longest edges of sharp triangles at a point of the surface between their ends.

Bisection of the longest edge (Rivara) makes no angle larger by itself, but gives the edge flips
that follow a vertex nearby. The new point is that of a PN triangle (Vlachos et al.): the midpoint,
lifted according to the normals at the ends.

References
M.-C. Rivara, "Algorithms for refining triangular grids suitable for adaptive and multigrid
techniques", Int. Journal for Numerical Methods in Engineering 20, 1984. doi:10.1002/nme.1620200412
A. Vlachos, J. Peters, C. Boyd & J. L. Mitchell, "Curved PN triangles", Symposium on Interactive 3D
Graphics 2001. doi:10.1145/364338.364387
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.meshes.validity import match_edges
from stereocell.model.lattice import Plane

COSINE = 0.7  # least cosine between the halves of a triangle and the whole

Points = NDArray[np.float64]
Indices = NDArray[np.int64]


def split_edges(
    positions: Points,
    normals: Points,
    *,
    triangles: Indices,
    wanted: NDArray[np.bool_],
    planes: tuple[Plane, ...],
    max_lift_um: float,
) -> tuple[Points, Points, Indices, Indices]:
    """Return new positions, normals and triangles, and the ends of the edges split, int64 (k, 2).

    positions    float64 (n, 3), um
    normals      float64 (n, 3), unit length
    triangles    int64 (m, 3)
    wanted       bool (m,): triangles whose longest edge is split. Boundary edges are not split; of
                 two edges of one triangle the longer one is
    planes       the cut planes: a new vertex keeps `max_lift_um` from them, unless an end is nearer
    max_lift_um  largest distance by which the surface moves

    New vertices come last, in the order of the ends, and new triangles too.
    """
    corners = positions[triangles]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    edges, twins, _ = match_edges(triangles)
    near = (3 * np.arange(len(triangles)) + sides.argmax(axis=1))[wanted]
    near = near[twins[near] >= 0]
    near = np.unique(np.minimum(near, twins[near]))
    far = twins[near]
    left, right = near // 3, far // 3
    u, v = edges[near].T
    a = triangles[left, (near - 3 * left + 2) % 3]
    b = triangles[right, (far - 3 * right + 2) % 3]
    middle, normal = _between(positions, normals, u, v)
    lift = np.linalg.norm(middle - (positions[u] + positions[v]) / 2, axis=1)
    # caps at the data's end have sharp edges
    middle = np.clip(middle, positions.min(axis=0), positions.max(axis=0))
    splits = lift <= max_lift_um
    splits &= _clear(middle, positions[u], positions[v], planes, max_lift_um)
    splits &= _lies_flat(middle, positions[u], positions[v], positions[a])
    splits &= _lies_flat(middle, positions[v], positions[u], positions[b])
    chosen = np.flatnonzero(splits)
    chosen = chosen[np.argsort(-sides.ravel()[near[chosen]], kind="stable")]
    rank = np.arange(len(chosen))
    first = np.full(len(triangles), len(chosen))
    np.minimum.at(first, left[chosen], rank)
    np.minimum.at(first, right[chosen], rank)
    chosen = chosen[(first[left[chosen]] == rank) & (first[right[chosen]] == rank)]
    new = len(positions) + np.arange(len(chosen))
    a, b, u, v = a[chosen], b[chosen], u[chosen], v[chosen]
    split = triangles.copy()
    split[left[chosen]] = np.stack([u, new, a], axis=1)
    split[right[chosen]] = np.stack([v, new, b], axis=1)
    halves = [np.stack([new, v, a], axis=1), np.stack([new, u, b], axis=1)]
    return (
        np.concatenate([positions, middle[chosen]]),
        np.concatenate([normals, normal[chosen]]),
        np.concatenate([split, *halves]),
        np.stack([u, v], axis=1),
    )


def _between(positions: Points, normals: Points, u: Indices, v: Indices) -> tuple[Points, Points]:
    """Return points of the surface between u and v, and their normals.

    The lift is the smaller of the ends' lifts, and 0 if one is up and the other down: at sharp
    edges normals don't describe the faces.
    """
    along = positions[v] - positions[u]
    rise = -(along * normals[u]).sum(axis=1), (along * normals[v]).sum(axis=1)
    least = np.minimum(np.abs(rise[0]), np.abs(rise[1]))
    agree = np.where(rise[0] * rise[1] > 0, np.sign(rise[0]), 0)
    normal = _unit(normals[u] + normals[v])
    return (positions[u] + positions[v]) / 2 + normal * (agree * least / 4)[:, None], normal


def _clear(
    middle: Points, p: Points, q: Points, planes: tuple[Plane, ...], margin_um: float
) -> NDArray[np.bool_]:
    """Return which points keep off the planes, farther than the margin or than one of the ends."""
    clear = np.ones(len(middle), bool)
    for column, value in planes:
        ends = np.stack([p[:, column], q[:, column]]) - value
        side = np.sign(ends.sum(axis=0))
        nearest = np.minimum((side * ends).min(axis=0), margin_um)
        clear &= side * (middle[:, column] - value) > nearest
    return clear


def _lies_flat(middle: Points, u: Points, v: Points, a: Points) -> NDArray[np.bool_]:
    """Return which triangles (u, v, a) have both halves facing as the whole does: no folds."""
    whole = _unit(np.cross(v - u, a - u))
    halves = np.cross(middle - u, a - u), np.cross(v - middle, a - middle)
    one, other = ((_unit(half) * whole).sum(axis=1) > COSINE for half in halves)
    return one & other


def _unit(vectors: Points) -> Points:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
