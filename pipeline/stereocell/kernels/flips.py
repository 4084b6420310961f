"""Flip the common edge of two triangles if that widens the sharpest angle of the two.

References
C. L. Lawson, "Transforming triangulations", Discrete Mathematics 3, 1972.
doi:10.1016/0012-365X(72)90093-3
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.half_edges import Ints, count_fans, following, match_twins, preceding
from stereocell.kernels.triangles import Points, doubled_area, smallest_angle_cosine

ROUNDS = 8  # largest number of rounds over all due edges
GAIN = 1e-3  # least gain in the smallest angle, as a difference of cosines
# Squared cosine of the largest turn of a triangle from the mean normal of both: 45 degrees
TURN = 0.5


@part
def _are_joined(a: int, b: int, h: int, twins: Ints, corner: Ints) -> bool:
    """Return whether the edge ab exists already; half-edge h leaves a."""
    g = h
    while True:
        if corner[following(g)] == b or corner[preceding(g)] == b:
            return True
        g = twins[preceding(g)]
        if g == h:
            return False
        if g < 0:
            break
    g = h
    while twins[g] >= 0:
        g = following(twins[g])
        if corner[following(g)] == b or corner[preceding(g)] == b:
            return True
    return False


@part
def _moves_far(at: Points, u: int, v: int, a: int, b: int, max_distance: float) -> bool:
    """Return whether the lines uv and ab are more than max_distance apart."""
    ex, ey, ez = at[v, 0] - at[u, 0], at[v, 1] - at[u, 1], at[v, 2] - at[u, 2]
    fx, fy, fz = at[b, 0] - at[a, 0], at[b, 1] - at[a, 1], at[b, 2] - at[a, 2]
    x, y, z = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    length = np.sqrt(x * x + y * y + z * z)
    away = x * (at[a, 0] - at[u, 0]) + y * (at[a, 1] - at[u, 1]) + z * (at[a, 2] - at[u, 2])
    return not abs(away) <= max_distance * length or length <= 0


@part
def _folds(at: Points, u: int, v: int, a: int, b: int) -> bool:
    """Return whether the triangles (a, u, b) and (b, v, a) face away from those at the edge uv."""
    px, py, pz = doubled_area(at, u, v, a)
    qx, qy, qz = doubled_area(at, v, u, b)
    x, y, z = px + qx, py + qy, pz + qz
    size = x * x + y * y + z * z
    for p, q, r in ((a, u, b), (b, v, a)):
        nx, ny, nz = doubled_area(at, p, q, r)
        along = nx * x + ny * y + nz * z
        if along <= 0 or along * along < TURN * size * (nx * nx + ny * ny + nz * nz):
            return True
    return False


@part
def _pair(twins: Ints, is_due: NDArray[np.bool_], h: int, g: int) -> None:
    """Make two half-edges twins, or make h a border if g is negative."""
    twins[h] = g
    if g >= 0:
        twins[g] = h
        is_due[g // 3] = True


@kernel
def flip_edges(
    at: Points,
    triangles: Ints,
    locked: NDArray[np.bool_],
    planes: NDArray[np.uint8],
    caps: NDArray[np.uint8],
    errors: Points,
    sharp: float,
) -> int:
    """Flip edges of sharp triangles, in place; return the number of flips.

    at         float64 (n, 3)
    triangles  int32 (m, 3); edges of borders stay
    locked     bool (n,); an edge stays if a vertex of its two triangles is locked
    planes     uint8 (n,), a bit for each cut plane that a vertex lies in
    caps       uint8 (n,), a bit for each cap that a vertex lies in; edges of caps stay in them
    errors     float64 (n,), largest distance by which the surface may move at a vertex
    sharp      cosine of the angle below which a triangle is sharp
    """
    corner = triangles.ravel()
    twins = match_twins(triangles, len(at))
    leaving, valence = count_fans(triangles, twins, len(at))
    # A vertex of a border may keep one triangle; other vertices keep three.
    for v in range(len(at)):
        if leaving[v] >= 0 and valence[v] > 0 and twins[leaving[v]] < 0:
            valence[v] += 2
    is_due = np.ones(len(triangles), np.bool_)
    total = 0
    for _ in range(ROUNDS):
        flipped = 0
        for t in range(len(triangles)):
            if not is_due[t]:
                continue
            is_due[t] = False
            a, b, v = corner[3 * t], corner[3 * t + 1], corner[3 * t + 2]
            if smallest_angle_cosine(at, a, b, v) <= sharp:
                continue
            chosen, least = -1, 2.0
            for k in range(3):
                h = 3 * t + k
                g = twins[h]
                if g < 0:
                    continue
                u, v = corner[h], corner[following(h)]
                a, b = corner[preceding(h)], corner[preceding(g)]
                if a == b or valence[u] <= 3 or valence[v] <= 3 or valence[a] < 0:
                    continue
                if locked[u] or locked[v] or locked[a] or locked[b]:
                    continue
                if planes[a] & planes[b] & (planes[u] | planes[v]):
                    continue
                if caps[u] & caps[v] & ~(caps[a] & caps[b]):
                    continue
                before = max(smallest_angle_cosine(at, u, v, a), smallest_angle_cosine(at, v, u, b))
                after = max(smallest_angle_cosine(at, a, u, b), smallest_angle_cosine(at, b, v, a))
                if after >= min(least, before - GAIN) or _moves_far(at, u, v, a, b, errors[u]):
                    continue
                if _folds(at, u, v, a, b) or _are_joined(a, b, preceding(h), twins, corner):
                    continue
                chosen, least = h, after
            if chosen < 0:
                continue
            h, g = chosen, twins[chosen]
            hn, hp, gn, gp = following(h), preceding(h), following(g), preceding(g)
            u, v, a, b = corner[h], corner[hn], corner[hp], corner[gp]
            va, au, ub, bv = twins[hn], twins[hp], twins[gn], twins[gp]
            corner[h], corner[hn], corner[hp] = a, u, b
            corner[g], corner[gn], corner[gp] = b, v, a
            _pair(twins, is_due, h, au)
            _pair(twins, is_due, hn, ub)
            _pair(twins, is_due, g, bv)
            _pair(twins, is_due, gn, va)
            _pair(twins, is_due, hp, gp)
            is_due[h // 3] = is_due[g // 3] = True
            valence[u] -= 1
            valence[v] -= 1
            valence[a] += 1
            valence[b] += 1
            flipped += 1
        total += flipped
        if flipped == 0:
            break
    return total
