"""Self-intersections of a mesh: pairs of triangles that share a point beside common corners.

All decisions are signs of determinants, exact for float64 coordinates, as libigl has them
(Shewchuk). Pairs without a common corner go to libigl's search tree and test (Guigue & Devillers).
Pairs with a common corner are tested here: libigl decides those by tolerances, and misses edges
that lie on each other.

References
J. R. Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
predicates", Discrete & Computational Geometry 18, 1997. doi:10.1007/PL00009321
P. Guigue & O. Devillers, "Fast and robust triangle-triangle overlap test using orientation
predicates", Journal of Graphics Tools 8(1), 2003. doi:10.1080/10867651.2003.10487580
"""

from collections.abc import Iterable, Iterator

import numpy as np
from igl import predicates
from numpy.typing import NDArray

Points = NDArray[np.float64]
Indices = NDArray[np.int64]
_BLOCK = 400_000  # pairs at a time
MARGIN = 1e-6  # smaller cosines and mean normals are in doubt; float64 rounds far below it
TINY = 1e-300  # least length: corners on no line can have an area that rounds to zero
ERROR_BOUND = (7 + 56 * 2.0**-53) * 2.0**-53  # of orient3d, relative: Shewchuk's bound A


def find_crossings(
    positions: Points,
    triangles: Indices,
    *,
    one_fan: NDArray[np.bool_] | None = None,
    fresh: NDArray[np.bool_] | None = None,
) -> Indices:
    """Return the pairs of triangles that meet beside their common corners, int64 (n, 2), sorted.

    positions  float64 (n, 3)
    triangles  int64 (m, 3), each with three different corners on no line: others have no plane,
               and the caller leaves them out
    one_fan    bool (n,), vertices known to have one closed fan of triangles, wound alike; most of
               them need no exact test
    fresh      bool (m,); each pair has at least one such triangle. All triangles, if not given
    """
    if fresh is None:
        fresh = np.ones(len(triangles), bool)
    if not fresh.any():
        return np.zeros((0, 2), np.int64)
    doubtful = np.zeros(len(positions), bool)
    doubtful[triangles[fresh]] = True
    if one_fan is not None:
        whole = doubtful[triangles].any(axis=1)  # all triangles around these vertices
        doubtful &= ~(one_fan & _spread_out(positions, triangles[whole]))
    near = [
        _meet(positions, triangles, pairs[fresh[pairs].any(axis=1)])
        for pairs in _gathered(_neighbours(triangles, doubtful))
    ]
    pairs = np.concatenate([_apart(positions, triangles, fresh), *near])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def _apart(positions: Points, triangles: Indices, fresh: NDArray[np.bool_]) -> Indices:
    """Return the pairs (n, 2) without common corners that meet, each with a fresh triangle."""
    positions = np.ascontiguousarray(positions)
    new, old = np.flatnonzero(fresh), np.flatnonzero(~fresh)
    _, found, _ = predicates.find_self_intersections(
        positions, np.ascontiguousarray(triangles[new])
    )
    pairs = new[found.reshape(-1, 2)]
    if len(old):
        _, found, _ = predicates.find_intersections(
            positions, triangles[new], positions, triangles[old]
        )
        found = found.reshape(-1, 2)
        pairs = np.concatenate([pairs, np.stack([new[found[:, 0]], old[found[:, 1]]], axis=1)])
    return pairs[~_share_corners(triangles, pairs)]


def _spread_out(positions: Points, triangles: Indices) -> NDArray[np.bool_]:
    """Return the vertices whose fan, seen along the mean normal, turns one way, and once.

    Then its triangles lie beside each other in that view, and meet only in their common corners.
    Floats suffice: a value within MARGIN, far above their rounding, counts as a no.
    """
    corners = positions[triangles]
    a, b, c = corners.transpose(1, 0, 2)
    area = np.cross(b - a, c - a)
    area = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), TINY)
    count = len(positions)
    flat = triangles.ravel()
    each = np.repeat(area, 3, axis=0)
    mean = np.stack([np.bincount(flat, each[:, k], count) for k in range(3)], axis=1)
    length = np.linalg.norm(mean, axis=1)
    mean = mean / np.maximum(length, MARGIN)[:, None]
    axis = mean[triangles]  # (m, corner, 3)
    out = np.roll(corners, -1, axis=1) - corners
    back = np.roll(corners, 1, axis=1) - corners
    turn = np.einsum("mkd,mkd->mk", np.cross(out, back), axis)
    along = np.einsum("mkd,mkd->mk", out, back)
    along -= np.einsum("mkd,mkd->mk", out, axis) * np.einsum("mkd,mkd->mk", back, axis)
    angles = np.bincount(flat, np.arctan2(turn, along).ravel(), count)
    ahead = (area[:, None, :] * axis).sum(axis=2) > MARGIN
    turns = np.bincount(flat, ahead.ravel(), count) == np.bincount(flat, minlength=count)
    return turns & (length > MARGIN) & (angles < 2 * np.pi + 0.1)


def orient_3d(a: Points, b: Points, c: Points, d: Points) -> NDArray[np.int32]:
    """Return the exact sign of the volume of a, b, c, d, int32 (n,); points float64 (n, 3).

    Floats decide where the determinant is larger than its error can be (bound A of Shewchuk's
    orient3d), exact arithmetic elsewhere: those are few, and each call of it starts threads.
    """
    u, v, w = a - d, b - d, c - d
    first, second = (
        np.roll(v, -1, axis=1) * np.roll(w, -2, axis=1),
        np.roll(v, -2, axis=1) * np.roll(w, -1, axis=1),
    )
    volume = (u * (first - second)).sum(axis=1)
    bound = ERROR_BOUND * (np.abs(u) * (np.abs(first) + np.abs(second))).sum(axis=1)
    signs = np.sign(volume).astype(np.int32)
    doubtful = np.flatnonzero(np.abs(volume) <= bound)
    if len(doubtful):
        points = (np.ascontiguousarray(x[doubtful]) for x in (a, b, c, d))
        signs[doubtful] = np.asarray(predicates.orient3d(*points)).ravel()
    return signs


def orient_2d(a: Points, b: Points, c: Points) -> NDArray[np.int32]:
    """Return the exact sign of the area of a, b, c, int32 (n,); points float64 (n, 2)."""
    # libigl takes arrays in 3D only: a tetrahedron over the triangle has the same sign
    a, b, c = (np.pad(x, ((0, 0), (0, 1))) for x in (a, b, c))
    return orient_3d(a, b, c, np.broadcast_to([0.0, 0.0, -1.0], (len(a), 3)))


def are_collinear(a: Points, b: Points, c: Points) -> NDArray[np.bool_]:
    """Return whether a, b, c lie on a line, exactly, bool (n,); points float64 (n, 3).

    They do if they lie on a line in all three projections.
    """
    flat = np.ones(len(a), bool)
    for axes in ([0, 1], [1, 2], [0, 2]):
        left = np.flatnonzero(flat)
        flat[left] = orient_2d(a[left][:, axes], b[left][:, axes], c[left][:, axes]) == 0
    return flat


def _share_corners(triangles: Indices, pairs: Indices) -> NDArray[np.bool_]:
    first, second = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    return (first[:, :, None] == second[:, None, :]).any(axis=(1, 2))


def _neighbours(triangles: Indices, vertices: NDArray[np.bool_]) -> Iterator[Indices]:
    """Yield all pairs (n, 2) of triangles around each of the vertices, in blocks.

    A pair that shares an edge may be yielded at both of its ends.
    """
    corners = np.flatnonzero(vertices[triangles])
    place = triangles.ravel()[corners]
    order = np.argsort(place, kind="stable")
    around = corners[order] // 3
    starts = np.flatnonzero(np.diff(place[order], prepend=-1))
    sizes = np.diff(starts, append=len(order))
    for size in np.unique(sizes[sizes > 1]).tolist():
        i, j = np.triu_indices(size, 1)
        groups = starts[sizes == size]
        step = max(1, _BLOCK // len(i))
        for start in range(0, len(groups), step):
            first = groups[start : start + step, None]
            yield np.stack([around[first + i], around[first + j]], axis=-1).reshape(-1, 2)


def _gathered(blocks: Iterable[Indices]) -> Iterator[Indices]:
    """Yield the same pairs in few blocks: each exact test starts threads, even for few pairs."""
    held: list[Indices] = []
    for block in blocks:
        held.append(block)
        if sum(map(len, held)) >= _BLOCK:
            yield np.concatenate(held)
            held = []
    if held:
        yield np.concatenate(held)


def _meet(positions: Points, triangles: Indices, pairs: Indices) -> Indices:
    """Return the pairs, of those with common corners, that meet elsewhere too."""
    same = triangles[pairs[:, 0]][:, :, None] == triangles[pairs[:, 1]][:, None, :]
    common = same.sum(axis=(1, 2))
    by_edge = pairs[common == 2]
    hits = [pairs[common == 3], by_edge[_folded(positions, triangles, by_edge, same[common == 2])]]
    one = common == 1
    by_vertex, place = pairs[one], same[one].reshape(-1, 9).argmax(axis=1)
    p, q = np.divmod(place, 3)
    rows = np.arange(len(by_vertex))
    first, second = triangles[by_vertex[:, 0]], triangles[by_vertex[:, 1]]
    corners = (
        first[rows, p],
        first[rows, (p + 1) % 3],
        first[rows, (p + 2) % 3],
        second[rows, (q + 1) % 3],
        second[rows, (q + 2) % 3],
    )
    hits.append(by_vertex[_fans_meet(*(positions[corner] for corner in corners))])
    return np.concatenate(hits)


def _folded(
    positions: Points, triangles: Indices, pairs: Indices, same: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return which pairs with a common edge overlap: coplanar, on the same side of it."""
    rows = np.arange(len(pairs))
    own, other = (~same.any(axis=2)).argmax(axis=1), (~same.any(axis=1)).argmax(axis=1)
    first, second = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    u, v = positions[first[rows, (own + 1) % 3]], positions[first[rows, (own + 2) % 3]]
    a, b = positions[first[rows, own]], positions[second[rows, other]]
    folded = np.zeros(len(pairs), bool)
    level = np.flatnonzero(orient_3d(u, v, a, b) == 0)
    axes = _projection(u[level], v[level], a[level])
    u2, v2, a2, b2 = (np.take_along_axis(x[level], axes, axis=1) for x in (u, v, a, b))
    folded[level] = orient_2d(u2, v2, a2) * orient_2d(u2, v2, b2) > 0
    return folded


def _fans_meet(v: Points, a: Points, b: Points, c: Points, d: Points) -> NDArray[np.bool_]:
    """Return which triangles (v, a, b) and (v, c, d) meet beside v.

    A common point beside v lies on a ray from v. The ray leaves one triangle, through the side
    opposite v, while it is still in the other: so that side meets the other triangle.
    """
    of_a, of_b = orient_3d(v, c, d, a), orient_3d(v, c, d, b)
    meet = np.zeros(len(v), bool)
    left = np.flatnonzero(of_a * of_b <= 0)
    v, a, b, c, d = (x[left] for x in (v, a, b, c, d))
    of_a, of_b = of_a[left], of_b[left]
    of_c, of_d = orient_3d(v, a, b, c), orient_3d(v, a, b, d)
    level = (of_a == 0) & (of_b == 0)
    near = np.flatnonzero(~level & (of_c * of_d <= 0))
    hit = np.zeros(len(left), bool)
    v3, a3, b3, c3, d3 = (x[near] for x in (v, a, b, c, d))
    hit[near] = _side_meets(a3, b3, v3, c3, d3) | _side_meets(c3, d3, v3, a3, b3)
    flat = np.flatnonzero(level)
    axes = _projection(v[flat], a[flat], b[flat])
    v2, a2, b2, c2, d2 = (np.take_along_axis(x[flat], axes, axis=1) for x in (v, a, b, c, d))
    hit[flat] = (
        _in_cone(v2, a2, b2, c2)
        | _in_cone(v2, a2, b2, d2)
        | _in_cone(v2, c2, d2, a2)
        | _in_cone(v2, c2, d2, b2)
    )
    meet[left] = hit
    return meet


def _side_meets(p: Points, q: Points, u: Points, v: Points, w: Points) -> NDArray[np.bool_]:
    """Return where the segment pq, which is not in its plane, meets the triangle uvw."""
    straddles = orient_3d(u, v, w, p) * orient_3d(u, v, w, q) <= 0
    signs = np.stack([orient_3d(p, q, u, v), orient_3d(p, q, v, w), orient_3d(p, q, w, u)])
    outside = (signs > 0).any(axis=0) & (signs < 0).any(axis=0)
    return np.logical_and(straddles, ~outside)


def _in_cone(v: Points, a: Points, b: Points, c: Points) -> NDArray[np.bool_]:
    """Return where the ray vc lies between the rays va and vb, or on one of them (2D)."""
    turn = orient_2d(v, a, b)
    return (orient_2d(v, a, c) * turn >= 0) & (orient_2d(v, c, b) * turn >= 0)


def _projection(a: Points, b: Points, c: Points) -> Indices:
    """Return, for each triangle, two axes (n, 2) on which its projection has area, exactly."""
    axes = np.zeros((len(a), 2), np.int64)
    left = np.arange(len(a))
    for pair in ([0, 1], [1, 2], [0, 2]):
        axes[left] = pair
        left = left[orient_2d(a[left][:, pair], b[left][:, pair], c[left][:, pair]) == 0]
    return axes
