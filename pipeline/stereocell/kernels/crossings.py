"""Pairs of triangles that may meet, by a uniform grid and by floats that know their error.

A pair is left out only where floats are sure that it does not meet. All others are returned, for
exact tests (meshes/self_intersections.py): few are, on meshes that touch themselves nowhere.

References
J. R. Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
predicates", Discrete & Computational Geometry 18, 1997. doi:10.1007/PL00009321
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.half_edges import Ints
from stereocell.kernels.triangles import Points

# relative errors of the determinants of orient3d and orient2d: Shewchuk's bounds A
ERROR_3D = (7 + 56 * 2.0**-53) * 2.0**-53
ERROR_2D = (3 + 16 * 2.0**-53) * 2.0**-53
UNSURE = 2  # in place of a sign
FACING = 1e-6  # least cosine of two normals that says on which side of an edge triangles lie


@part
def _orient(at: Points, a: int, b: int, c: int, d: int) -> int:
    """Return the sign of the volume of a, b, c, d, or UNSURE."""
    ux, uy, uz = at[a, 0] - at[d, 0], at[a, 1] - at[d, 1], at[a, 2] - at[d, 2]
    vx, vy, vz = at[b, 0] - at[d, 0], at[b, 1] - at[d, 1], at[b, 2] - at[d, 2]
    wx, wy, wz = at[c, 0] - at[d, 0], at[c, 1] - at[d, 1], at[c, 2] - at[d, 2]
    p1, p2, q1, q2, r1, r2 = vy * wz, vz * wy, vz * wx, vx * wz, vx * wy, vy * wx
    volume = ux * (p1 - p2) + uy * (q1 - q2) + uz * (r1 - r2)
    size = (abs(p1) + abs(p2)) * abs(ux) + (abs(q1) + abs(q2)) * abs(uy)
    size += (abs(r1) + abs(r2)) * abs(uz)
    if volume > ERROR_3D * size:
        return 1
    return -1 if volume < -ERROR_3D * size else UNSURE


@part
def _one_side(at: Points, a: int, b: int, c: int, d: int, e: int, f: int) -> bool:
    """Return whether d, e, f lie on one side of the plane of a, b, c, for sure."""
    side = _orient(at, a, b, c, d)
    if side == UNSURE or side != _orient(at, a, b, c, e):
        return False
    return side == _orient(at, a, b, c, f)


@part
def _may_pierce(at: Points, p: int, q: int, u: int, v: int, w: int) -> bool:
    """Return whether the segment pq may meet the triangle uvw."""
    side = _orient(at, u, v, w, p)
    if side != UNSURE and side == _orient(at, u, v, w, q):
        return False
    x, y, z = _orient(at, p, q, u, v), _orient(at, p, q, v, w), _orient(at, p, q, w, u)
    if x == UNSURE or y == UNSURE or z == UNSURE:
        return True
    return x == y and y == z


@part
def _may_meet_apart(at: Points, triangles: Ints, i: int, j: int) -> bool:
    """Return whether two triangles without a common corner may meet."""
    a, b, c = triangles[i]
    d, e, f = triangles[j]
    if _one_side(at, a, b, c, d, e, f) or _one_side(at, d, e, f, a, b, c):
        return False
    return (
        _may_pierce(at, a, b, d, e, f)
        or _may_pierce(at, b, c, d, e, f)
        or _may_pierce(at, c, a, d, e, f)
        or _may_pierce(at, d, e, a, b, c)
        or _may_pierce(at, e, f, a, b, c)
        or _may_pierce(at, f, d, a, b, c)
    )


@part
def _may_meet_at_corner(at: Points, v: int, a: int, b: int, c: int, d: int) -> bool:
    """Return whether the triangles (v, a, b) and (v, c, d) may meet beside v."""
    p, q = _orient(at, v, c, d, a), _orient(at, v, c, d, b)
    if p != UNSURE and p == q:
        return False
    r, s = _orient(at, v, a, b, c), _orient(at, v, a, b, d)
    if r != UNSURE and r == s:
        return False
    if p == UNSURE or q == UNSURE or r == UNSURE or s == UNSURE:
        return True
    return _may_pierce(at, a, b, v, c, d) or _may_pierce(at, c, d, v, a, b)


@part
def _may_fold(at: Points, u: int, v: int, a: int, b: int) -> bool:
    """Return whether two triangles at the edge uv, with the tips a and b, may overlap."""
    if _orient(at, u, v, a, b) != UNSURE:
        return False
    ex, ey, ez = at[v, 0] - at[u, 0], at[v, 1] - at[u, 1], at[v, 2] - at[u, 2]
    px, py, pz = at[a, 0] - at[u, 0], at[a, 1] - at[u, 1], at[a, 2] - at[u, 2]
    qx, qy, qz = at[b, 0] - at[u, 0], at[b, 1] - at[u, 1], at[b, 2] - at[u, 2]
    nx, ny, nz = ey * pz - ez * py, ez * px - ex * pz, ex * py - ey * px
    mx, my, mz = ey * qz - ez * qy, ez * qx - ex * qz, ex * qy - ey * qx
    size = np.sqrt((nx * nx + ny * ny + nz * nz) * (mx * mx + my * my + mz * mz))
    return not (size > 0 and nx * mx + ny * my + nz * mz < -FACING * size)


@part
def _may_meet(at: Points, triangles: Ints, i: int, j: int) -> bool:
    """Return whether two triangles may meet beside their common corners."""
    common, p, q = 0, 0, 0
    own, other = 7, 7  # bits of the corners that are not common
    for k in range(3):
        for l in range(3):  # noqa: E741
            if triangles[i, k] == triangles[j, l]:
                common, p, q = common + 1, k, l
                own &= ~(1 << k)
                other &= ~(1 << l)
    if common == 0:
        return _may_meet_apart(at, triangles, i, j)
    a, b = triangles[i, (p + 1) % 3], triangles[i, (p + 2) % 3]
    if common == 1:
        c, d = triangles[j, (q + 1) % 3], triangles[j, (q + 2) % 3]
        return _may_meet_at_corner(at, triangles[i, p], a, b, c, d)
    if common == 2 and own in (1, 2, 4) and other in (1, 2, 4):
        k, l = own >> 1, other >> 1  # noqa: E741  1, 2, 4 to 0, 1, 2
        u, v = triangles[i, (k + 1) % 3], triangles[i, (k + 2) % 3]
        return _may_fold(at, u, v, triangles[i, k], triangles[j, l])
    return True


@kernel
def find_doubtful(
    at: Points,
    triangles: Ints,
    fresh: NDArray[np.bool_],
    low: Points,
    high: Points,
    first: Ints,
    listed: Ints,
    origin: Points,
    edge: float,
    shape: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Return the pairs of triangles (n, 2) that may meet, each with a fresh one.

    low, high                           corners of the triangles' boxes
    first, listed, origin, edge, shape  of their grid: kernels/grid.py
    """
    _, ny, nz = shape
    found, count = np.empty((1024, 2), np.int64), 0
    for c in range(len(first) - 1):
        if first[c + 1] - first[c] < 2:
            continue
        cx, cy, cz = c // (ny * nz), (c // nz) % ny, c % nz
        for p in range(first[c], first[c + 1]):
            i = listed[p]
            for q in range(p + 1, first[c + 1]):
                j = listed[q]
                if not (fresh[i] or fresh[j]):
                    continue
                x, y, z = max(low[i, 0], low[j, 0]), max(low[i, 1], low[j, 1]), 0.0
                z = max(low[i, 2], low[j, 2])
                if x > min(high[i, 0], high[j, 0]) or y > min(high[i, 1], high[j, 1]):
                    continue
                if z > min(high[i, 2], high[j, 2]):
                    continue
                # only in the cell that holds the least corner of the common box
                if int((x - origin[0]) / edge) != cx or int((y - origin[1]) / edge) != cy:
                    continue
                if int((z - origin[2]) / edge) != cz or not _may_meet(at, triangles, i, j):
                    continue
                if count == len(found):
                    larger = np.empty((2 * count, 2), np.int64)
                    larger[:count] = found
                    found = larger
                found[count, 0], found[count, 1] = i, j
                count += 1
    return found[:count]


@part
def _has_area(at: Points, a: int, b: int, c: int, j: int, k: int) -> bool:
    p = (at[a, j] - at[c, j]) * (at[b, k] - at[c, k])
    q = (at[a, k] - at[c, k]) * (at[b, j] - at[c, j])
    return abs(p - q) > ERROR_2D * (abs(p) + abs(q))


@kernel
def find_maybe_flat(at: Points, triangles: Ints) -> NDArray[np.bool_]:
    """Return whether the corners of each triangle may lie on a line, bool (m,)."""
    maybe = np.empty(len(triangles), np.bool_)
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        maybe[t] = not (
            _has_area(at, a, b, c, 0, 1)
            or _has_area(at, a, b, c, 1, 2)
            or _has_area(at, a, b, c, 0, 2)
        )
    return maybe
