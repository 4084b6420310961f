"""Find pairs of triangles that may intersect, by a uniform grid and bounds of rounding errors.

A pair is left out only if floating-point arithmetic proves that it does not intersect. All other
pairs go to exact tests (meshes/self_intersections.py). Meshes that touch themselves nowhere have
few of them.
References
J. R. Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
predicates", Discrete & Computational Geometry 18, 1997. doi:10.1007/PL00009321
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.half_edges import Ints
from stereocell.kernels.triangles import Points, Triple, doubled_area

# Relative errors of the determinants of orient3d and orient2d: Shewchuk's bounds A
ERROR_3D = (7 + 56 * 2.0**-53) * 2.0**-53
ERROR_2D = (3 + 16 * 2.0**-53) * 2.0**-53
UNSURE = 2  # value of a sign that is not certain
FACING = 1e-6  # least cosine of two normals that shows on which side of an edge the triangles lie


@part
def _sign(
    ux: float,
    uy: float,
    uz: float,
    vx: float,
    vy: float,
    vz: float,
    wx: float,
    wy: float,
    wz: float,
) -> int:
    """Return the sign of the volume that three vectors (differences of points) span, or UNSURE."""
    p1, p2, q1, q2, r1, r2 = vy * wz, vz * wy, vz * wx, vx * wz, vx * wy, vy * wx
    volume = ux * (p1 - p2) + uy * (q1 - q2) + uz * (r1 - r2)
    size = (abs(p1) + abs(p2)) * abs(ux) + (abs(q1) + abs(q2)) * abs(uy)
    size += (abs(r1) + abs(r2)) * abs(uz)
    if volume > ERROR_3D * size:
        return 1
    return -1 if volume < -ERROR_3D * size else UNSURE


@part
def _orient(at: Points, a: int, b: int, c: int, d: int) -> int:
    """Return the sign of the volume of the tetrahedron a, b, c, d, or UNSURE."""
    ux, uy, uz = at[a, 0] - at[d, 0], at[a, 1] - at[d, 1], at[a, 2] - at[d, 2]
    vx, vy, vz = at[b, 0] - at[d, 0], at[b, 1] - at[d, 1], at[b, 2] - at[d, 2]
    wx, wy, wz = at[c, 0] - at[d, 0], at[c, 1] - at[d, 1], at[c, 2] - at[d, 2]
    return _sign(ux, uy, uz, vx, vy, vz, wx, wy, wz)


@part
def _one_side(at: Points, a: int, b: int, c: int, d: int, e: int, f: int) -> bool:
    """Return whether d, e, f certainly lie on one side of the plane of a, b, c."""
    side = _orient(at, a, b, c, d)
    if side == UNSURE or side != _orient(at, a, b, c, e):
        return False
    return side == _orient(at, a, b, c, f)


@part
def _may_pierce(at: Points, p: int, q: int, u: int, v: int, w: int) -> bool:
    """Return whether the segment pq may intersect the triangle uvw."""
    side = _orient(at, u, v, w, p)
    if side != UNSURE and side == _orient(at, u, v, w, q):
        return False
    x, y, z = _orient(at, p, q, u, v), _orient(at, p, q, v, w), _orient(at, p, q, w, u)
    if x == UNSURE or y == UNSURE or z == UNSURE:
        return True
    return x == y and y == z


@part
def _turn(at: Points, a: int, b: int, c: int, j: int, k: int) -> int:
    """Return the sign of the area of a, b, c, projected on the axes j and k, or UNSURE."""
    p = (at[a, j] - at[c, j]) * (at[b, k] - at[c, k])
    q = (at[a, k] - at[c, k]) * (at[b, j] - at[c, j])
    if abs(p - q) <= ERROR_2D * (abs(p) + abs(q)):
        return UNSURE
    return 1 if p > q else -1


@part
def _is_beyond(at: Points, a: int, b: int, c: int, d: int, e: int, f: int, j: int, k: int) -> bool:
    """Return whether d, e, f certainly lie beyond a side of a, b, c, projected on j and k."""
    for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
        own = _turn(at, p, q, r, j, k)
        if own != UNSURE and (
            _turn(at, p, q, d, j, k) == -own
            and _turn(at, p, q, e, j, k) == -own
            and _turn(at, p, q, f, j, k) == -own
        ):
            return True
    return False


@part
def _are_seen_apart(at: Points, a: int, b: int, c: int, d: int, e: int, f: int) -> bool:
    """Return whether two triangles are certainly disjoint in a projection along an axis.

    This decides pairs of triangles in one plane, too.
    """
    for j, k in ((0, 1), (1, 2), (2, 0)):
        if _is_beyond(at, a, b, c, d, e, f, j, k) or _is_beyond(at, d, e, f, a, b, c, j, k):
            return True
    return False


@part
def _may_meet_apart(at: Points, triangles: Ints, i: int, j: int) -> bool:
    """Return whether two triangles without a common corner may intersect."""
    a, b, c = triangles[i, 0], triangles[i, 1], triangles[i, 2]
    d, e, f = triangles[j, 0], triangles[j, 1], triangles[j, 2]
    if _one_side(at, a, b, c, d, e, f) or _one_side(at, d, e, f, a, b, c):
        return False
    return (
        _may_pierce(at, a, b, d, e, f)
        or _may_pierce(at, b, c, d, e, f)
        or _may_pierce(at, c, a, d, e, f)
        or _may_pierce(at, d, e, a, b, c)
        or _may_pierce(at, e, f, a, b, c)
        or _may_pierce(at, f, d, a, b, c)
    ) and not _are_seen_apart(at, a, b, c, d, e, f)


@part
def _are_cones_seen_apart(at: Points, v: int, a: int, b: int, c: int, d: int) -> bool:
    """Return whether a side at v of the triangle (v, a, b) certainly separates it from (v, c, d).

    The triangles are projected along each axis, so this decides triangles in one plane, too.
    """
    for j, k in ((0, 1), (1, 2), (2, 0)):
        for p, q in ((a, b), (b, a)):
            own = _turn(at, v, p, q, j, k)
            if own != UNSURE and (
                _turn(at, v, p, c, j, k) == -own and _turn(at, v, p, d, j, k) == -own
            ):
                return True
    return False


@part
def _may_meet_at_corner(at: Points, v: int, a: int, b: int, c: int, d: int) -> bool:
    """Return whether the triangles (v, a, b) and (v, c, d) may intersect away from v."""
    p, q = _orient(at, v, c, d, a), _orient(at, v, c, d, b)
    if p != UNSURE and p == q:
        return False
    r, s = _orient(at, v, a, b, c), _orient(at, v, a, b, d)
    if r != UNSURE and r == s:
        return False
    if p == UNSURE or q == UNSURE or r == UNSURE or s == UNSURE:
        return not (
            _are_cones_seen_apart(at, v, a, b, c, d) or _are_cones_seen_apart(at, v, c, d, a, b)
        )
    return _may_pierce(at, a, b, v, c, d) or _may_pierce(at, c, d, v, a, b)


@part
def _may_fold(at: Points, u: int, v: int, a: int, b: int) -> bool:
    """Return whether two triangles with the common edge uv and the tips a and b may overlap."""
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
    """Return whether two triangles may intersect away from their common corners."""
    common, p, q = 0, 0, 0
    own, other = 7, 7  # bits of the corners that are not shared
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
        k, l = own >> 1, other >> 1  # noqa: E741  maps 1, 2, 4 to 0, 1, 2
        u, v = triangles[i, (k + 1) % 3], triangles[i, (k + 2) % 3]
        return _may_fold(at, u, v, triangles[i, k], triangles[j, l])
    return True


@part
def _is_seen_as_fan(
    at: Points, v: int, size: int, start: int, onward: Ints, stamp: Ints, n: Triple, r: Triple
) -> bool:
    """Return whether the triangles of v certainly form one fan around it, seen along n.

    Each triangle then turns the same way, and together they go around v once.

    onward  the next neighbour after each neighbour, where stamp is v
    r       a direction in which no neighbour is likely to lie
    """
    ax, ay, az = at[start, 0] - at[v, 0], at[start, 1] - at[v, 1], at[start, 2] - at[v, 2]
    past = _sign(n[0], n[1], n[2], r[0], r[1], r[2], ax, ay, az)
    b, rounds = start, 0
    for step in range(size):
        b = onward[b]
        if past == UNSURE or stamp[b] != v or (b == start) != (step == size - 1):
            return False
        bx, by, bz = at[b, 0] - at[v, 0], at[b, 1] - at[v, 1], at[b, 2] - at[v, 2]
        if _sign(n[0], n[1], n[2], ax, ay, az, bx, by, bz) != 1:
            return False
        side = _sign(n[0], n[1], n[2], r[0], r[1], r[2], bx, by, bz)
        rounds += past < side
        ax, ay, az, past = bx, by, bz, side
    return past != UNSURE and rounds == 1


@kernel
def find_spread(at: Points, triangles: Ints) -> NDArray[np.bool_]:
    """Return the vertices whose triangles certainly lie side by side, as bool (n,).

    Seen along some direction, the triangles form a fan that goes around the vertex once. So any two
    of them share nothing but their common corners and the edge between these.
    """
    count = len(at)
    first, place = np.zeros(count + 1, np.int32), np.zeros(count, np.int32)
    for t in range(len(triangles)):
        for k in range(3):
            first[triangles[t, k] + 1] += 1
    for v in range(count):
        first[v + 1] += first[v]
        place[v] = first[v]
    # Ends of the side opposite to the vertex in each of its triangles
    ends = np.empty((3 * len(triangles), 2), np.int32)
    for t in range(len(triangles)):
        for k in range(3):
            v = triangles[t, k]
            ends[place[v], 0] = triangles[t, (k + 1) % 3]
            ends[place[v], 1] = triangles[t, (k + 2) % 3]
            place[v] += 1
    spread = np.zeros(count, np.bool_)
    onward, stamp = np.empty(count, np.int32), np.full(count, -1, np.int32)
    for v in range(count):
        low, high = first[v], first[v + 1]
        if high - low < 3:
            continue
        nx, ny, nz, is_ring = 0.0, 0.0, 0.0, True
        for e in range(low, high):
            a, b = ends[e, 0], ends[e, 1]
            x, y, z = doubled_area(at, v, a, b)
            nx, ny, nz = nx + x, ny + y, nz + z
            is_ring = is_ring and stamp[a] != v
            stamp[a], onward[a] = v, b
        if is_ring:
            a, b = ends[low, 0], ends[low, 1]
            rx = 0.7 * (at[a, 0] - at[v, 0]) + 0.3 * (at[b, 0] - at[v, 0])
            ry = 0.7 * (at[a, 1] - at[v, 1]) + 0.3 * (at[b, 1] - at[v, 1])
            rz = 0.7 * (at[a, 2] - at[v, 2]) + 0.3 * (at[b, 2] - at[v, 2])
            n, r = (nx, ny, nz), (rx, ry, rz)
            spread[v] = _is_seen_as_fan(at, v, high - low, a, onward, stamp, n, r)
    return spread


@part
def _share_spread(triangles: Ints, i: int, j: int, spread: NDArray[np.bool_]) -> bool:
    """Return whether two triangles have a common corner that is in `spread`."""
    a, b, c = triangles[i, 0], triangles[i, 1], triangles[i, 2]
    shared = False
    for k in range(3):
        v = triangles[j, k]
        shared |= ((v == a) | (v == b) | (v == c)) & spread[v]
    return shared


@kernel
def find_candidates(
    at: Points,
    triangles: Ints,
    fresh: NDArray[np.bool_],
    spread: NDArray[np.bool_],
    low: Points,
    high: Points,
    first: Ints,
    listed: Ints,
    origin: Points,
    edge: float,
    shape: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Return the pairs of triangles (n, 2) that may intersect, if one of the pair has changed.

    fresh                               bool (m,), triangles that have changed
    spread                              vertices from `find_spread`, where triangles do not
                                        intersect
    low, high                           corners of the triangles' boxes
    first, listed, origin, edge, shape  grid of the triangles, see kernels/grid.py
    """
    nx, ny, _ = shape
    found, count = np.empty((1024, 2), np.int64), 0
    most = 1
    for c in range(len(first) - 1):
        most = max(most, first[c + 1] - first[c])
    # The boxes of one cell's triangles, a coordinate after another, so that the processor compares
    # one box with several others at a time
    x0, y0, z0 = np.empty(most), np.empty(most), np.empty(most)
    x1, y1, z1 = np.empty(most), np.empty(most), np.empty(most)
    # Bits 1, 2 and 4: the box starts in the cell along x, y and z; 8: the triangle is fresh
    bits, near = np.empty(most, np.uint8), np.empty(most, np.bool_)
    for c in range(len(first) - 1):
        size = first[c + 1] - first[c]
        if size < 2:
            continue
        cx, cy, cz = c % nx, (c // nx) % ny, c // (nx * ny)
        here = listed[first[c] : first[c + 1]]
        for p in range(size):
            i = here[p]
            x0[p], y0[p], z0[p] = low[i, 0], low[i, 1], low[i, 2]
            x1[p], y1[p], z1[p] = high[i, 0], high[i, 1], high[i, 2]
            bits[p] = int((low[i, 0] - origin[0]) / edge) == cx
            bits[p] |= (int((low[i, 1] - origin[1]) / edge) == cy) << 1
            bits[p] |= (int((low[i, 2] - origin[2]) / edge) == cz) << 2
            bits[p] |= fresh[i] << 3
        for p in range(size - 1):
            # Variables, because the compiler reads an array again after each write to `near`
            left, back, under, own = x0[p], y0[p], z0[p], bits[p]
            right, front, over = x1[p], y1[p], z1[p]
            for q in range(p + 1, size):
                is_near = (x0[q] <= right) & (y0[q] <= front) & (z0[q] <= over)
                is_near &= (x1[q] >= left) & (y1[q] >= back) & (z1[q] >= under)
                # A pair counts only in the cell with the least corner of the common box.
                near[q] = is_near & ((bits[q] | own) == 15)
            i = here[p]
            for q in range(p + 1, size):
                j = here[q]
                if not near[q] or _share_spread(triangles, i, j, spread):
                    continue
                if not _may_meet(at, triangles, i, j):
                    continue
                if count == len(found):
                    larger = np.empty((2 * count, 2), np.int64)
                    for n in range(count):
                        larger[n, 0], larger[n, 1] = found[n, 0], found[n, 1]
                    found = larger
                found[count, 0], found[count, 1] = i, j
                count += 1
    return found[:count]


@kernel
def find_maybe_flat(at: Points, triangles: Ints) -> NDArray[np.bool_]:
    """Return the triangles whose corners may lie on a line, as bool (m,)."""
    maybe = np.empty(len(triangles), np.bool_)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        maybe[t] = not (
            _turn(at, a, b, c, 0, 1) != UNSURE
            or _turn(at, a, b, c, 1, 2) != UNSURE
            or _turn(at, a, b, c, 0, 2) != UNSURE
        )
    return maybe
