"""Half-edge collapses: a vertex moves onto a neighbour, which stays, and two triangles go.

A collapse costs the quadric error of its target (Garland & Heckbert), a mean squared distance from
the planes of all triangles that have gone into the vertex, as a share of what its body may have.
Cheap collapses come first, in a few classes of cost rather than by a queue. A collapse is made only
where the result is sound by itself, as said below.

A mesh is worked on block by block, each of some thousand vertices near one another, and at last as
a whole, for what became possible at the blocks' seams. What takes the time is waiting for memory:
passes over the whole mesh, in the order of its planes, take nearly twice as long.

Where more vertices are locked than in a try before, what was done then is done again without a
look, but around them: the result differs there alone, and takes a third of the time.

The result is sound where:

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

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.edge_records import (
    RECORD,
    TWIN,
    ahead,
    behind,
    count_common,
    fill_records,
    join,
)
from stereocell.kernels.half_edges import Ints, count_fans, find_fixed, match_twins
from stereocell.kernels.near_order import order_triangles, order_vertices
from stereocell.kernels.triangles import Points, closest, doubled_area, smallest_angle_cosine

CLASSES = 6  # number of classes of cost
PASSES = 4  # passes over one class; the last class has LAST
LAST = 40
MAX_NEIGHBOURS = 512  # neighbours of a vertex that is looked at
NEVER = 32000  # class of a vertex that has no collapse
TURN = 0.25  # squared cosine of the largest turn of a triangle: 60 degrees
SLIVER = 0.9945  # cosine of 6 degrees: the normal of a sharper triangle says little
SHARPER = 0.36  # square of the least share of the sharpest angle, .6: 1 - cos goes with the square
VALENCE = 24  # most neighbours of two ends together
SURE = 1 - 1e-9  # share of a class's bound: a lower price, even rounded, is in no higher class
BLOCK = 4096  # vertices that are worked on together
LINE = 64  # bytes of the cache


@part
def price_of(quadrics: Points, u: int, at: Points, v: int) -> float:
    """Return the mean squared distance of v from u's planes, in squared errors."""
    # by numbers, here and below: a view of a row is counted, by operations that are atomic
    x, y, z = at[v, 0], at[v, 1], at[v, 2]
    square = quadrics[u, 0] * x * x + quadrics[u, 1] * y * y + quadrics[u, 2] * z * z
    square += quadrics[u, 9]
    square += 2 * (
        quadrics[u, 3] * x * y
        + quadrics[u, 4] * x * z
        + quadrics[u, 5] * y * z
        + quadrics[u, 6] * x
        + quadrics[u, 7] * y
        + quadrics[u, 8] * z
    )
    return max(square, 0.0) / quadrics[u, 10] if quadrics[u, 10] > 0 else 0.0


@part
def add_plane(at: Points, a: int, b: int, c: int, errors: Points, quadrics: Points) -> None:
    """Add a triangle's plane, weighted by its doubled area, to its corners' quadrics.

    at        float64 (n, 3)
    errors    float64 (n,), largest allowed distance of each vertex from its planes
    quadrics  float64 (n, 11), written
    Source: Garland & Heckbert, "Surface simplification using quadric error metrics",
    SIGGRAPH 1997. doi:10.1145/258734.258849
    """
    x, y, z = doubled_area(at, a, b, c)
    w = np.sqrt(x * x + y * y + z * z)
    if w <= 0:
        return
    x, y, z = x / w, y / w, z / w
    d = -(x * at[a, 0] + y * at[a, 1] + z * at[a, 2])
    for v in (a, b, c):
        quadrics[v, 0] += w * x * x
        quadrics[v, 1] += w * y * y
        quadrics[v, 2] += w * z * z
        quadrics[v, 3] += w * x * y
        quadrics[v, 4] += w * x * z
        quadrics[v, 5] += w * y * z
        quadrics[v, 6] += w * x * d
        quadrics[v, 7] += w * y * d
        quadrics[v, 8] += w * z * d
        quadrics[v, 9] += w * d * d
        quadrics[v, 10] += w * errors[v] * errors[v]


@part
def sum_planes(at: Points, corner: Ints, errors: Points, quadrics: Points) -> None:
    """Add the planes of all triangles; corner int32 (3 m,), three each. See `add_plane`."""
    for t in range(len(corner) // 3):
        add_plane(at, corner[3 * t], corner[3 * t + 1], corner[3 * t + 2], errors, quadrics)


@part
def _cheapest(
    quadrics: Points, u: int, at: Points, leaving: Ints, edges: Ints, enough: float
) -> float:
    """Return the least price of u's collapses, or one below `enough`; u is no border's vertex."""
    start = leaving[u]
    best, h = np.inf, start
    while True:
        best = min(best, price_of(quadrics, u, at, edges[ahead(h)]))
        h = edges[behind(h) + TWIN]
        if h == start or best < enough:
            return best


@part
def class_of(price: float) -> int:
    """Return the class of cost of a price, a squared distance in squared bounds; NEVER above 1."""
    return int(np.sqrt(price) * CLASSES) if price <= 1 else NEVER


@part
def keeps_form(
    at: Points,
    u: int,
    v: int,
    ring: Ints,
    onward: Ints,
    size: int,
    mean: tuple[float, float, float],
    allowed: float,
    planes: NDArray[np.uint8],
) -> bool:
    """Return whether the triangles around u may have v in its place.

    ring, onward  of each triangle the two other corners, and the number of triangles
    mean          sum of their doubled areas
    """
    bx, by, bz = mean
    length = bx * bx + by * by + bz * bz
    for k in range(size):
        x, y = ring[k], onward[k]
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
def _distance_after(at: Points, u: int, v: int, ring: Ints, onward: Ints, size: int) -> float:
    """Return the distance of u from the triangles that take the place of its own."""
    least = np.inf
    for k in range(size):
        x, y = ring[k], onward[k]
        if x != v and y != v:
            square, _ = closest(at[u, 0], at[u, 1], at[u, 2], at, v, x, y)
            least = min(least, square)
    return np.sqrt(least)


@part
def _move_onto(
    u: int,
    v: int,
    h: int,
    strayed: float,
    out: Ints,
    size: int,
    at: Points,
    quadrics: Points,
    edges: Ints,
    leaving: Ints,
    is_left: NDArray[np.bool_],
) -> None:
    """Let u become v, to which its half-edge h goes; out has all that leave it."""
    at[v, 3] = max(at[v, 3], strayed)
    is_left[h // RECORD] = is_left[edges[h + TWIN] // RECORD] = False
    join(h, v, out, size, edges, leaving)
    for p in range(11):
        quadrics[v, p] += quadrics[u, p]
    leaving[u] = -1


@kernel
def collapse_in_place(
    given: Points,
    triangles: Ints,
    locked: NDArray[np.bool_],
    planes: NDArray[np.uint8],
    errors: Points,
    stray: float,
    sharpest: float,
    past: Ints,
    block: int,
    at: Points,
    quadrics: Points,
    edges: Ints,
) -> tuple[NDArray[np.bool_], Ints]:
    """Return which triangles are left, bool (m,); their corners are in `edges` then.

    And what was done, int32 (k, 2): a vertex, and the one onto which it moved.

    block         vertices that are done with, all classes, before the next ones; then come all
    at            float64 (n, 4), written: where vertices are, and how far what went into them is
    quadrics      float64 (n, 12), of zeros
    edges         int32 (8 m,), written: kernels/edge_records.py

    Others are those of `collapse`. The last three are made by numpy, which asks for large pages.
    """
    n, m = len(given), len(triangles)
    twins = match_twins(triangles, n)
    leaving, valence = count_fans(triangles, twins, n)
    stays = find_fixed(locked, triangles.ravel(), twins, valence)
    fill_records(triangles, twins, leaving, edges)
    for v in range(n):
        at[v, 0], at[v, 1], at[v, 2], at[v, 3] = given[v, 0], given[v, 1], given[v, 2], 0.0
    for t in range(0, RECORD * m, RECORD):
        add_plane(at, edges[t], edges[t + 1], edges[t + 2], errors, quadrics)
    is_left = np.ones(m, np.bool_)
    ring, onward = np.empty(MAX_NEIGHBOURS, np.int32), np.empty(MAX_NEIGHBOURS, np.int32)
    out, price = np.empty(MAX_NEIGHBOURS, np.int32), np.empty(MAX_NEIGHBOURS)
    made, steps = np.empty((n, 2), np.int32), 0
    differs = np.full(n, len(past) == 0, np.bool_)  # from what was around a vertex at that time
    for i in range(len(past)):
        u, v = past[i, 0], past[i, 1]
        size, chosen, start = 0, -1, leaving[u]
        h = start
        if stays[u] or differs[u] or differs[v]:
            differs[u] = differs[v] = True
            while True:
                differs[edges[ahead(h)]] = True
                h = edges[behind(h) + TWIN]
                if h == start:
                    break
            continue
        while True:  # as long as it was then: at most MAX_NEIGHBOURS
            ring[size], onward[size], out[size] = edges[ahead(h)], edges[behind(h)], h
            if ring[size] == v:
                chosen = h
            size += 1
            h = edges[behind(h) + TWIN]
            if h == start:
                break
        strayed = at[u, 3] + _distance_after(at, u, v, ring, onward, size)
        _move_onto(u, v, chosen, strayed, out, size, at, quadrics, edges, leaving, is_left)
        made[steps, 0], made[steps, 1] = u, v
        steps += 1
    cost = np.full(n, NEVER, np.int16)
    for u in range(n):
        if differs[u] and not stays[u]:
            enough = SURE / CLASSES**2
            cost[u] = class_of(_cheapest(quadrics, u, at, leaving, edges, enough))
    stamp, tick = np.zeros(n, np.int32), 0
    touched, turn = np.zeros(n, np.int32), 0
    waiting = np.empty(n + 1, np.int32)
    blocks = -(-n // block) if n > block and len(past) == 0 else 0
    for number in range(blocks + 1):
        is_last = number == blocks
        low, high = (0, n) if is_last else (number * block, min((number + 1) * block, n))
        for step in range(CLASSES * PASSES + LAST):
            k = min(step // PASSES, CLASSES)
            if step % PASSES == 0 and step <= CLASSES * PASSES:
                is_done = False
            if is_done:
                continue
            count, turn, done = 0, turn + 1, 0
            for u in range(low, high):
                waiting[count] = u
                count += cost[u] <= k
            enough = SURE * min(1.0, ((k + 1) / CLASSES) ** 2)
            for i in range(count):
                u = waiting[i]
                if touched[u] == turn or cost[u] > k:
                    continue
                size, start, best, o = 0, leaving[u], np.inf, -1
                h = start
                while size < MAX_NEIGHBOURS:
                    v, last = edges[ahead(h)], edges[behind(h)]
                    ring[size], onward[size], out[size] = v, last, h
                    price[size] = price_of(quadrics, u, at, v)
                    if price[size] < best:
                        best, o = price[size], size
                    size += 1
                    h = edges[behind(h) + TWIN]
                    if h == start:
                        break
                if h != start:
                    cost[u] = NEVER
                    continue
                cost[u] = class_of(best)
                if cost[u] > k:
                    continue
                worst, bx, by, bz = 0.0, 0.0, 0.0, 0.0
                tick += 1
                for j in range(size):
                    v, last = ring[j], onward[j]
                    stamp[v] = tick
                    worst = max(worst, smallest_angle_cosine(at, u, v, last))
                    x, y, z = doubled_area(at, u, v, last)
                    bx, by, bz = bx + x, by + y, bz + z
                allowed = sharpest
                if worst > sharpest:
                    allowed = max(sharpest, 1 - SHARPER * (1 - worst))
                while cost[u] <= k:  # the next neighbour, in order of price
                    v, h, strayed = ring[o], out[o], np.inf
                    if keeps_form(at, u, v, ring, onward, size, (bx, by, bz), allowed, planes):
                        common, others = count_common(h, edges, stamp, tick)
                        if common == 2 and 7 <= others + size <= VALENCE:
                            strayed = at[u, 3] + _distance_after(at, u, v, ring, onward, size)
                    if strayed > stray * errors[u]:
                        price[o], best = np.inf, np.inf
                        for j in range(size):
                            if price[j] < best:
                                best, o = price[j], j
                        cost[u] = class_of(best)
                        continue
                    _move_onto(u, v, h, strayed, out, size, at, quadrics, edges, leaving, is_left)
                    made[steps, 0], made[steps, 1] = u, v
                    steps += 1
                    cost[u] = NEVER
                    if not stays[v]:
                        cost[v] = class_of(_cheapest(quadrics, v, at, leaving, edges, enough))
                    for p in range(size):
                        w = ring[p]
                        touched[w] = turn
                        if w == v or stays[w] or cost[w] <= k:
                            continue
                        c = max(class_of(price_of(quadrics, w, at, v)), k)
                        cost[w] = min(cost[w], c)
                        if cost[w] == NEVER:  # what was refused may be allowed now
                            cost[w] = min(k + 1, CLASSES)
                    done += 1
            few = done * 200 < count or (is_last and done < 50)
            is_done = done == 0 or (k < CLASSES and few)
    return is_left, made[:steps]


def collapse(
    at: Points,
    triangles: Ints,
    locked: NDArray[np.bool_],
    planes: NDArray[np.uint8],
    errors: Points,
    stray: float,
    sharpest: float,
    past: Ints,
) -> tuple[Ints, NDArray[np.bool_], Ints]:
    """Return the triangles by the vertices that are left, int32 (m, 3), and which are left.

    And what was done, int32 (k, 2): a vertex, and the one onto which it moved.

    at         float64 (n, 3); near the origin, for the quadrics' sake
    triangles  int32 (m, 3)
    locked     bool (n,), vertices that stay; those of borders stay anyway, and those whose
               triangles make no single fan
    planes     uint8 (n,), a bit for each cut plane that a vertex lies in
    errors     float64 (n,), largest root of the mean squared distance from the planes; it is the
               same for all vertices of a body
    stray      errors; largest distance of a vertex from the result, added up over its collapses
    sharpest   cosine of the smallest angle that a triangle may get
    past       what was done before more vertices were locked; (0, 2): nothing was
    """
    n, m = len(at), len(triangles)
    room = _zeros(4 * n, np.float64).reshape(n, 4), _zeros(12 * n, np.float64).reshape(n, 12)
    edges = _zeros(RECORD * m, np.int32)
    if n <= BLOCK:
        given = at, triangles, locked, planes, errors
        left, made = collapse_in_place(*given, stray, sharpest, past, BLOCK, *room, edges)
        return np.ascontiguousarray(edges.reshape(m, RECORD)[:, :3]), left, made
    order = order_vertices(at)
    place = np.empty(n, np.int32)
    place[order] = np.arange(n, dtype=np.int32)
    turns = order_triangles(triangles, place)
    given = at[order], place[triangles[turns]], locked[order], planes[order], errors[order]
    left, made = collapse_in_place(*given, stray, sharpest, place[past], BLOCK, *room, edges)
    result, is_left = np.empty((m, 3), np.int32), np.empty(m, bool)
    is_left[turns] = left
    result[turns] = order[edges.reshape(m, RECORD)[:, :3]]
    return result, is_left, order[made]


def _zeros(size: int, kind: type[np.float64 | np.int32]) -> NDArray[Any]:
    """Return zeros that start where a line of the cache does."""
    numbers = LINE // np.dtype(kind).itemsize
    room = np.zeros(size + numbers, kind)
    start = -room.ctypes.data % LINE // room.itemsize
    return room[start : start + size]
