"""Half-edge collapses: a vertex moves onto a neighbour, which stays, and two triangles go.

A collapse costs the quadric error of its target (Garland & Heckbert), a mean squared distance from
the planes of all triangles that have gone into the vertex, as a share of what its body may have.
Cheap collapses come first, in a few classes of cost rather than by a queue. A collapse is made only
where the result is sound by itself:

- the two ends have two common neighbours (the link condition): topology stays
- each triangle turns by less than 60 degrees, or was a sliver and faces as its surroundings do
- no triangle gets sharper than the bound, or than .6 of the sharpest one around
- no triangle comes to lie in a cut plane
- the vertex, and all that went into it, are near the new triangles: distances add up

References
M. Garland & P. S. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
doi:10.1145/258734.258849
H. Hoppe, "Progressive meshes", SIGGRAPH 1996. doi:10.1145/237170.237216
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.half_edges import (
    Ints,
    count_fans,
    find_fixed,
    following,
    match_twins,
    preceding,
)
from stereocell.kernels.triangles import Points, closest, doubled_area, smallest_angle_cosine

CLASSES = 6  # of cost
PASSES = 4  # over one class; the last class has LAST
LAST = 40
MAX_NEIGHBOURS = 512  # neighbours of a vertex that is looked at
NEVER = 32000  # class of a vertex that has no collapse
TURN = 0.25  # squared cosine of the largest turn of a triangle: 60 degrees
SLIVER = 0.9945  # cosine of 6 degrees: the normal of a sharper triangle says little
SHARPER = 0.36  # of the sharpest angle around .6 is allowed: 1 - cos goes with its square
VALENCE = 24  # most neighbours of two ends together


@part
def price_of(quadrics: Points, u: int, at: Points, v: int) -> float:
    """Return the mean squared distance of v from u's planes, in squared errors."""
    x, y, z = at[v]
    q = quadrics[u]
    square = q[0] * x * x + q[1] * y * y + q[2] * z * z + q[9]
    square += 2 * (q[3] * x * y + q[4] * x * z + q[5] * y * z + q[6] * x + q[7] * y + q[8] * z)
    return max(square, 0.0) / q[10] if q[10] > 0 else 0.0


@part
def sum_planes(at: Points, corner: Ints, errors: Points, quadrics: Points) -> None:
    """Add each triangle's plane, weighted by its doubled area, to its corners' quadrics.

    at        float64 (n, 3)
    corner    int32 (3 m,), three a triangle
    errors    float64 (n,), largest allowed distance of each vertex from its planes
    quadrics  float64 (n, 11), written
    Source: Garland & Heckbert, "Surface simplification using quadric error metrics",
    SIGGRAPH 1997. doi:10.1145/258734.258849
    """
    for t in range(len(corner) // 3):
        a, b, c = corner[3 * t], corner[3 * t + 1], corner[3 * t + 2]
        x, y, z = doubled_area(at, a, b, c)
        w = np.sqrt(x * x + y * y + z * z)
        if w <= 0:
            continue
        x, y, z = x / w, y / w, z / w
        d = -(x * at[a, 0] + y * at[a, 1] + z * at[a, 2])
        for v in (a, b, c):
            q = quadrics[v]
            q[0] += w * x * x
            q[1] += w * y * y
            q[2] += w * z * z
            q[3] += w * x * y
            q[4] += w * x * z
            q[5] += w * y * z
            q[6] += w * x * d
            q[7] += w * y * d
            q[8] += w * z * d
            q[9] += w * d * d
            q[10] += w * errors[v] * errors[v]


@part
def _cheapest(
    quadrics: Points, u: int, at: Points, leaving: Ints, twins: Ints, corner: Ints
) -> float:
    """Return the least price of u's collapses; u is no vertex of a border."""
    best, h = np.inf, leaving[u]
    while True:
        best = min(best, price_of(quadrics, u, at, corner[following(h)]))
        h = twins[preceding(h)]
        if h == leaving[u]:
            return best


@part
def class_of(price: float) -> int:
    """Return the class of cost of a price, a squared distance in squared bounds; NEVER above 1."""
    return int(np.sqrt(price) * CLASSES) if price <= 1 else NEVER


@part
def count_common(h: int, twins: Ints, corner: Ints, stamp: Ints, tick: int) -> tuple[int, int]:
    """Return how many neighbours of the target carry the stamp, and how many it has.

    h  the half-edge to the target
    """
    common, valence = 0, 0
    start = twins[h]
    g = start
    while True:
        valence += 1
        if stamp[corner[following(g)]] == tick:
            common += 1
        onward = twins[preceding(g)]
        if onward < 0:  # the border: its other end, and then the other way round
            valence += 1
            if stamp[corner[preceding(g)]] == tick:
                common += 1
            g = start
            while twins[g] >= 0:
                g = following(twins[g])
                valence += 1
                if stamp[corner[following(g)]] == tick:
                    common += 1
            return common, valence
        g = onward
        if g == start:
            return common, valence


@part
def keeps_form(
    at: Points,
    corner: Ints,
    u: int,
    v: int,
    ring: Ints,
    out: Ints,
    size: int,
    mean: tuple[float, float, float],
    allowed: float,
    planes: NDArray[np.uint8],
) -> bool:
    """Return whether the triangles around u may have v in its place."""
    bx, by, bz = mean
    length = bx * bx + by * by + bz * bz
    for k in range(size):
        x, y = ring[k], corner[preceding(out[k])]
        if x == v or y == v:
            continue
        if planes[v] & planes[x] & planes[y]:
            return False
        ax, ay, az = doubled_area(at, u, x, y)
        nx, ny, nz = doubled_area(at, v, x, y)
        before, after = ax * ax + ay * ay + az * az, nx * nx + ny * ny + nz * nz
        along = ax * nx + ay * ny + az * nz
        if along <= 0 or along * along < TURN * before * after:
            if smallest_angle_cosine(at, u, x, y) < SLIVER:
                return False
            along = bx * nx + by * ny + bz * nz
            if along <= 0 or along * along < TURN * length * after:
                return False
        if smallest_angle_cosine(at, v, x, y) > allowed:
            return False
    return True


@part
def _distance_after(
    at: Points, corner: Ints, u: int, v: int, ring: Ints, out: Ints, size: int
) -> float:
    """Return the distance of u from the triangles that take the place of its own."""
    least = np.inf
    for k in range(size):
        x, y = ring[k], corner[preceding(out[k])]
        if x != v and y != v:
            square, _ = closest(at[u, 0], at[u, 1], at[u, 2], at, v, x, y)
            least = min(least, square)
    return np.sqrt(least)


@part
def join(h: int, v: int, out: Ints, size: int, twins: Ints, corner: Ints, leaving: Ints) -> None:
    """Move the start of half-edge h onto its end, v, and take its two triangles out."""
    g = twins[h]
    a, b = corner[preceding(h)], corner[preceding(g)]
    for k in range(size):
        corner[out[k]] = v
    left, right = twins[following(h)], twins[preceding(h)]
    if left >= 0:
        twins[left] = right
    twins[right] = left
    ahead, behind = twins[following(g)], twins[preceding(g)]
    twins[ahead] = behind
    if behind >= 0:
        twins[behind] = ahead
    leaving[v], leaving[a], leaving[b] = right, following(right), ahead


@kernel
def collapse(
    at: Points,
    triangles: Ints,
    locked: NDArray[np.bool_],
    planes: NDArray[np.uint8],
    errors: Points,
    stray: float,
    sharpest: float,
) -> Ints:
    """Return the triangles that are left, int32 (k, 3), by the same vertices.

    at         float64 (n, 3); near the origin, for the quadrics' sake
    triangles  int32 (m, 3)
    locked     bool (n,), vertices that stay; those of borders stay anyway, and those whose
               triangles make no single fan
    planes     uint8 (n,), a bit for each cut plane that a vertex lies in
    errors     float64 (n,), largest root of the mean squared distance from the planes; it is the
               same for all vertices of a body
    stray      errors; largest distance of a vertex from the result, added up over its collapses
    sharpest   cosine of the smallest angle that a triangle may get
    """
    n, m = len(at), len(triangles)
    result = triangles.copy()
    corner = result.ravel()
    twins = match_twins(triangles, n)
    leaving, valence = count_fans(triangles, twins, n)
    stays = find_fixed(locked, corner, twins, valence)
    quadrics = np.zeros((n, 11))
    sum_planes(at, corner, errors, quadrics)
    cost, gone = np.full(n, NEVER, np.int16), np.zeros(m, np.bool_)
    for u in range(n):
        if not stays[u]:
            cost[u] = class_of(_cheapest(quadrics, u, at, leaving, twins, corner))
    away, stamp, tick = np.zeros(n), np.zeros(n, np.int32), 0
    touched, turn = np.zeros(n, np.int32), 0
    ring, out = np.empty(MAX_NEIGHBOURS, np.int32), np.empty(MAX_NEIGHBOURS, np.int32)
    price, order = np.empty(MAX_NEIGHBOURS), np.empty(MAX_NEIGHBOURS, np.int32)
    waiting = np.empty(n, np.int32)
    for k in range(CLASSES + 1):
        for _ in range(PASSES if k < CLASSES else LAST):
            count, turn, done = 0, turn + 1, 0
            for u in range(n):
                if cost[u] <= k:
                    waiting[count] = u
                    count += 1
            for i in range(count):
                u = waiting[i]
                if touched[u] == turn or cost[u] > k:
                    continue
                # the neighbours, in order of price
                size, h, worst = 0, leaving[u], 0.0
                bx, by, bz = 0.0, 0.0, 0.0
                while size < MAX_NEIGHBOURS:
                    v = corner[following(h)]
                    ring[size], out[size] = v, h
                    price[size] = price_of(quadrics, u, at, v)
                    last = corner[preceding(h)]
                    worst = max(worst, smallest_angle_cosine(at, u, v, last))
                    x, y, z = doubled_area(at, u, v, last)
                    bx, by, bz = bx + x, by + y, bz + z
                    j = size
                    while j > 0 and price[order[j - 1]] > price[size]:
                        order[j] = order[j - 1]
                        j -= 1
                    order[j] = size
                    size += 1
                    h = twins[preceding(h)]
                    if h == leaving[u]:
                        break
                if h != leaving[u]:
                    cost[u] = NEVER
                    continue
                allowed = sharpest
                if worst > sharpest:
                    allowed = max(sharpest, 1 - SHARPER * (1 - worst))
                tick += 1
                for j in range(size):
                    stamp[ring[j]] = tick
                later = NEVER
                for j in range(size):
                    o = order[j]
                    c = class_of(price[o])
                    if c > k:
                        later = c
                        break
                    v, h = ring[o], out[o]
                    common, others = count_common(h, twins, corner, stamp, tick)
                    if common != 2 or not 7 <= others + size <= VALENCE:
                        continue
                    if not keeps_form(
                        at, corner, u, v, ring, out, size, (bx, by, bz), allowed, planes
                    ):
                        continue
                    strayed = away[u] + _distance_after(at, corner, u, v, ring, out, size)
                    if strayed > stray * errors[u]:
                        continue
                    away[v] = max(away[v], strayed)
                    gone[h // 3] = gone[twins[h] // 3] = True
                    join(h, v, out, size, twins, corner, leaving)
                    quadrics[v] += quadrics[u]
                    later = NEVER
                    leaving[u] = -1
                    if not stays[v]:
                        cost[v] = class_of(_cheapest(quadrics, v, at, leaving, twins, corner))
                    for p in range(size):
                        w = ring[p]
                        touched[w] = turn
                        if w == v or stays[w]:
                            continue
                        c = max(class_of(price_of(quadrics, w, at, v)), k)
                        cost[w] = min(cost[w], c)
                        if cost[w] == NEVER:  # what was refused may be allowed now
                            cost[w] = min(k + 1, CLASSES)
                    done += 1
                    break
                cost[u] = later
            if done == 0 or (k < CLASSES and (done * 200 < count or done < 50)):
                break
    left = 0
    for t in range(m):
        left += not gone[t]
    kept, j = np.empty((left, 3), np.int32), 0
    for t in range(m):
        if not gone[t]:
            kept[j] = result[t]
            j += 1
    return kept
