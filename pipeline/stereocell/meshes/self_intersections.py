"""Self-intersections of a mesh: pairs of triangles that share a point away from common corners.

All decisions are exact signs of determinants of float64 coordinates (Shewchuk), as in libigl. A
grid finds the pairs that are close. Floating-point arithmetic with bounds of its error removes the
pairs that certainly do not meet (kernels/crossings.py). Few remain. Pairs without a common corner
go to libigl's test (Guigue & Devillers). Pairs with a common corner are tested here, because libigl
decides those by tolerances, and misses edges that lie on each other.

References
J. R. Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
predicates", Discrete & Computational Geometry 18, 1997. doi:10.1007/PL00009321
P. Guigue & O. Devillers, "Fast and robust triangle-triangle overlap test using orientation
predicates", Journal of Graphics Tools 8(1), 2003. doi:10.1080/10867651.2003.10487580
"""

import numpy as np
from igl import predicates
from numpy.typing import NDArray

from stereocell.kernels.crossings import ERROR_3D, find_candidates, find_maybe_flat, find_spread
from stereocell.meshes.triangle_grid import find_around, make_grid

# If less than one in FEW triangles is to be checked, only these and the triangles around them are
# examined
FEW = 20

Points = NDArray[np.float64]
Indices = NDArray[np.int64]
Corners = NDArray[np.integer]  # (m, 3)


def find_crossings(
    positions: Points, triangles: Corners, *, fresh: NDArray[np.bool_] | None = None
) -> Indices:
    """Return the pairs of triangles that meet away from common corners, int64 (n, 2), sorted.

    positions  float64 (n, 3)
    triangles  integers (m, 3), each with three different corners that are not on a line. Other
               triangles have no plane, and the caller must leave them out.
    fresh      bool (m,); only pairs with a fresh triangle are returned. None: all pairs
    """
    if fresh is None:
        fresh = np.ones(len(triangles), bool)
    if not fresh.any():
        return np.zeros((0, 2), np.int64)
    positions = np.ascontiguousarray(positions)
    if fresh.sum() * FEW < len(triangles):
        part = find_around(positions, np.ascontiguousarray(triangles, np.int32), fresh)
        return part[_find_crossings(positions, triangles[part], fresh[part])]
    return _find_crossings(positions, triangles, fresh)


def _find_crossings(positions: Points, triangles: Corners, fresh: NDArray[np.bool_]) -> Indices:
    corners = np.ascontiguousarray(triangles, np.int32)
    grid = make_grid(positions, corners)
    pairs = find_candidates(
        positions,
        corners,
        fresh,
        find_spread(positions, corners),
        grid.low,
        grid.high,
        grid.first,
        grid.listed,
        grid.origin,
        grid.edge,
        grid.shape,
    )
    share = _share_corners(triangles, pairs)
    near = _meet(positions, triangles, pairs[share])
    apart = _apart(positions, triangles, pairs[~share])
    return np.unique(np.sort(np.concatenate([apart, near]), axis=1), axis=0)


def _apart(positions: Points, triangles: Corners, pairs: Indices) -> Indices:
    """Return those pairs (n, 2) of triangles without common corners that meet."""
    if not len(pairs):
        return pairs
    part = np.unique(pairs)
    _, found, _ = predicates.find_self_intersections(
        positions, np.ascontiguousarray(triangles[part], np.int64)
    )
    crossing = part[found.reshape(-1, 2)]
    numbers = (np.sort(some, axis=1) @ [len(triangles), 1] for some in (pairs, crossing))
    asked, hit = numbers
    return pairs[np.isin(asked, hit)]


def orient_3d(a: Points, b: Points, c: Points, d: Points) -> NDArray[np.int32]:
    """Return the exact sign of the volume of tetrahedra a b c d, int32 (n,); points float64 (n, 3).

    Floats decide if the determinant exceeds its largest error (bound A of Shewchuk's orient3d).
    Exact arithmetic decides the others, which are few: each call of it starts threads.
    """
    u, v, w = a - d, b - d, c - d
    first, second = (
        np.roll(v, -1, axis=1) * np.roll(w, -2, axis=1),
        np.roll(v, -2, axis=1) * np.roll(w, -1, axis=1),
    )
    volume = (u * (first - second)).sum(axis=1)
    bound = ERROR_3D * (np.abs(u) * (np.abs(first) + np.abs(second))).sum(axis=1)
    signs = np.sign(volume).astype(np.int32)
    doubtful = np.flatnonzero(np.abs(volume) <= bound)
    if len(doubtful):
        points = (np.ascontiguousarray(x[doubtful]) for x in (a, b, c, d))
        signs[doubtful] = np.asarray(predicates.orient3d(*points)).ravel()
    return signs


def orient_2d(a: Points, b: Points, c: Points) -> NDArray[np.int32]:
    """Return the exact sign of the area of triangles a b c, int32 (n,); points float64 (n, 2)."""
    # libigl takes points in 3D only. A tetrahedron over the triangle has the same sign.
    a, b, c = (np.pad(x, ((0, 0), (0, 1))) for x in (a, b, c))
    return orient_3d(a, b, c, np.broadcast_to([0.0, 0.0, -1.0], (len(a), 3)))


def are_collinear(a: Points, b: Points, c: Points) -> NDArray[np.bool_]:
    """Return whether a, b, c lie on a line, exactly, bool (n,); points float64 (n, 3).

    They lie on a line if they do so in all three projections.
    """
    flat = np.ones(len(a), bool)
    for axes in ([0, 1], [1, 2], [0, 2]):
        left = np.flatnonzero(flat)
        flat[left] = orient_2d(a[left][:, axes], b[left][:, axes], c[left][:, axes]) == 0
    return flat


def find_flat(positions: Points, triangles: Corners) -> Indices:
    """Return the triangles whose corners lie on a line, exactly (n,). See `find_crossings`."""
    maybe = np.flatnonzero(find_maybe_flat(positions, np.ascontiguousarray(triangles, np.int32)))
    return maybe[are_collinear(*positions[triangles[maybe]].transpose(1, 0, 2))]


def _share_corners(triangles: Corners, pairs: Indices) -> NDArray[np.bool_]:
    first, second = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    return (first[:, :, None] == second[:, None, :]).any(axis=(1, 2))


def _meet(positions: Points, triangles: Corners, pairs: Indices) -> Indices:
    """Return those pairs of triangles with common corners that also meet elsewhere."""
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
    positions: Points, triangles: Corners, pairs: Indices, same: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return which pairs with a common edge are coplanar and lie on the same side of it."""
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
    """Return which triangles (v, a, b) and (v, c, d) meet away from v.

    Such a point lies on a ray from v. The ray leaves one triangle, through the side opposite v,
    while it is still within the other triangle. Therefore that side meets the other triangle.
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
    """Return where the segment pq meets the triangle uvw; pq must not lie in its plane."""
    straddles = orient_3d(u, v, w, p) * orient_3d(u, v, w, q) <= 0
    signs = np.stack([orient_3d(p, q, u, v), orient_3d(p, q, v, w), orient_3d(p, q, w, u)])
    outside = (signs > 0).any(axis=0) & (signs < 0).any(axis=0)
    return np.logical_and(straddles, ~outside)


def _in_cone(v: Points, a: Points, b: Points, c: Points) -> NDArray[np.bool_]:
    """Return where the ray vc lies between the rays va and vb, or on one of them (2D)."""
    turn = orient_2d(v, a, b)
    return (orient_2d(v, a, c) * turn >= 0) & (orient_2d(v, c, b) * turn >= 0)


def _projection(a: Points, b: Points, c: Points) -> Indices:
    """Return two axes (n, 2) for each triangle on which its projection has area, exactly."""
    axes = np.zeros((len(a), 2), np.int64)
    left = np.arange(len(a))
    for pair in ([0, 1], [1, 2], [0, 2]):
        axes[left] = pair
        left = left[orient_2d(a[left][:, pair], b[left][:, pair], c[left][:, pair]) == 0]
    return axes
