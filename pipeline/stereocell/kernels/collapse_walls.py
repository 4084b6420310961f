"""Half-edge collapses in the walls between objects, which share edges and vertices.

Three walls and more meet in a line, lines in a corner. A vertex within a wall moves onto any
neighbour, one of a line along its line only, a corner stays. A collapse is made only where

- what the two ends have in common is what their edge has (the link condition, here for complexes
  of several sheets): topology stays, so does each object's
- each triangle turns by less than 60 degrees, and none gets sharper than the bound, or than .6 of
  the sharpest one around
- the vertex, and all that went into it, are near the new triangles, and one of a line near the new
  line: distances add up

Costs and classes are those of kernels/collapse.py. A triangle that is left keeps its place in the
list, so that it is known of which wall it is.

References
T. K. Dey, H. Edelsbrunner, S. Guha & D. V. Nekhayev, "Topology preserving edge contraction",
Publications de l'Institut Mathematique 66, 1999.
M. Garland & P. S. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
doi:10.1145/258734.258849
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.collapse import (
    CLASSES,
    LAST,
    NEVER,
    PASSES,
    SHARPER,
    TURN,
    VALENCE,
    class_of,
    price_of,
    sum_planes,
)
from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.half_edges import Ints, following, preceding
from stereocell.kernels.triangles import Points, closest, doubled_area, smallest_angle_cosine

MAX_TRIANGLES = 96  # triangles of a vertex that is looked at
WITHIN, ON_LINE, CORNER = 0, 1, 2


@part
def list_around(u: int, first: Ints, after: Ints, gone: NDArray[np.bool_], out: Ints) -> int:
    """Write the corners of the triangles round u; return how many, at most MAX_TRIANGLES + 1."""
    size, c = 0, first[u]
    while c >= 0:
        if not gone[c // 3]:
            if size == MAX_TRIANGLES:
                return MAX_TRIANGLES + 1
            out[size] = c
            size += 1
        c = after[c]
    return size


@part
def list_ring(
    size: int, out: Ints, corner: Ints, ring: Ints, shared: Ints, slot: Ints, stamp: Ints, tick: int
) -> int:
    """Write the neighbours, and of how many triangles each one's edge is; return how many."""
    count = 0
    for k in range(size):
        for v in (corner[following(out[k])], corner[preceding(out[k])]):
            if stamp[v] != tick:
                stamp[v] = tick
                slot[v] = count
                ring[count], shared[count] = v, 0
                count += 1
            shared[slot[v]] += 1
    return count


@part
def find_order(
    size: int, out: Ints, corner: Ints, shared: Ints, count: int, slot: Ints, seen: Ints
) -> int:
    """Return where a vertex is: within a wall, on a line, or in a corner."""
    ends, degree = 0, 0
    for j in range(count):
        if shared[j] < 2:
            return CORNER
        if shared[j] != 2:
            if ends and shared[j] != degree:
                return CORNER
            ends, degree = ends + 1, shared[j]
    if ends not in (0, 2):
        return CORNER
    # its neighbours hang together: else sheets meet in this point alone
    for j in range(count):
        seen[j] = j == 0
    changes, known = True, 1
    while changes:
        changes = False
        for k in range(size):
            a, b = slot[corner[following(out[k])]], slot[corner[preceding(out[k])]]
            if seen[a] != seen[b]:
                seen[a], seen[b] = 1, 1
                known += 1
                changes = True
    if known != count:
        return CORNER
    return ON_LINE if ends else WITHIN


@part
def fits(at: Points, corner: Ints, u: int, v: int, size: int, out: Ints, allowed: float) -> bool:
    """Return whether the triangles around u may have v in its place."""
    for k in range(size):
        x, y = corner[following(out[k])], corner[preceding(out[k])]
        if x == v or y == v:
            continue
        ax, ay, az = doubled_area(at, u, x, y)
        nx, ny, nz = doubled_area(at, v, x, y)
        along = ax * nx + ay * ny + az * nz
        before, after = ax * ax + ay * ay + az * az, nx * nx + ny * ny + nz * nz
        if along <= 0 or along * along < TURN * before * after:
            return False
        if smallest_angle_cosine(at, v, x, y) > allowed:
            return False
    return True


@part
def distance_after(
    at: Points, corner: Ints, u: int, v: int, beyond: int, size: int, out: Ints
) -> float:
    """Return how far u is from its triangles with v in its place, or from the line v to beyond."""
    if beyond >= 0:
        px, py, pz = at[beyond, 0] - at[v, 0], at[beyond, 1] - at[v, 1], at[beyond, 2] - at[v, 2]
        qx, qy, qz = at[u, 0] - at[v, 0], at[u, 1] - at[v, 1], at[u, 2] - at[v, 2]
        length = px * px + py * py + pz * pz
        share = (px * qx + py * qy + pz * qz) / length if length > 0 else 0.0
        share = min(max(share, 0.0), 1.0)
        dx, dy, dz = qx - share * px, qy - share * py, qz - share * pz
        square = dx * dx + dy * dy + dz * dz
        return np.sqrt(square)
    least = np.inf
    for k in range(size):
        x, y = corner[following(out[k])], corner[preceding(out[k])]
        if x != v and y != v:
            square, _ = closest(at[u, 0], at[u, 1], at[u, 2], at, v, x, y)
            least = min(least, square)
    return np.sqrt(least)


@part
def link_corners(n: int, corner: Ints) -> tuple[Ints, Ints]:
    """Return each vertex's first corner, or -1 (n,), and each corner's next of the same vertex."""
    first, after = np.full(n, -1, np.int32), np.empty(len(corner), np.int32)
    for c in range(len(corner) - 1, -1, -1):
        after[c] = first[corner[c]]
        first[corner[c]] = c
    return first, after


@part
def move_onto(
    u: int,
    v: int,
    size: int,
    out: Ints,
    corner: Ints,
    first: Ints,
    after: Ints,
    gone: NDArray[np.bool_],
    quadrics: Points,
) -> None:
    """Let u, of which `out` has the corners, become v."""
    last = first[v]
    while after[last] >= 0:
        last = after[last]
    for q in range(size):
        c = out[q]
        if corner[following(c)] == v or corner[preceding(c)] == v:
            gone[c // 3] = True
            continue
        corner[c] = v
        after[last], after[c] = c, -1
        last = c
    first[u] = -1
    for q in range(11):
        quadrics[v, q] += quadrics[u, q]
    # what v's own list holds of triangles that are gone is left out
    c, before = first[v], -1
    while c >= 0:
        onward = after[c]
        if gone[c // 3]:
            if before < 0:
                first[v] = onward
            else:
                after[before] = onward
        else:
            before = c
        c = onward


@kernel
def find_orders(triangles: Ints, n: int) -> NDArray[np.int8]:
    """Return where each of n vertices is: within a wall, on a line, or in a corner (n,)."""
    corner, gone = triangles.copy().ravel(), np.zeros(len(triangles), np.bool_)
    first, after = link_corners(n, corner)
    out, seen = np.empty(MAX_TRIANGLES, np.int32), np.empty(2 * MAX_TRIANGLES, np.int32)
    ring, shared = np.empty(2 * MAX_TRIANGLES, np.int32), np.empty(2 * MAX_TRIANGLES, np.int32)
    slot, stamp = np.zeros(n, np.int32), np.zeros(n, np.int32)
    order_of = np.full(n, CORNER, np.int8)
    for u in range(n):
        size = list_around(u, first, after, gone, out)
        if 0 < size <= MAX_TRIANGLES:
            count = list_ring(size, out, corner, ring, shared, slot, stamp, u + 1)
            order_of[u] = find_order(size, out, corner, shared, count, slot, seen)
    return order_of


@kernel
def collapse_walls(
    at: Points,
    triangles: Ints,
    locked: NDArray[np.bool_],
    errors: Points,
    stray: float,
    sharpest: float,
    order_of: NDArray[np.int8],
    past: Ints,
) -> tuple[Ints, NDArray[np.bool_], Ints]:
    """Return the triangles by the vertices that are left, int32 (m, 3), and which are gone.

    And what was done, int32 (k, 2): a vertex, and the one onto which it moved.

    at         float64 (n, 3); near the origin, for the quadrics' sake
    triangles  int32 (m, 3), of all walls
    locked     bool (n,), vertices that stay; corners stay anyway
    errors     float64 (n,), largest root of the mean squared distance from the planes
    stray      errors; largest distance of a vertex from the result, added up over its collapses
    sharpest   cosine of the smallest angle that a triangle may get
    order_of   of `find_orders`
    past       what was done before more vertices were locked: it is done again, without a look,
               where nothing around is otherwise than it was, and all else is tried anew. (0, 2):
               nothing was
    """
    n, m = len(at), len(triangles)
    result = triangles.copy()
    corner = result.ravel()
    gone = np.zeros(m, np.bool_)
    first, after = link_corners(n, corner)
    out, out_v = np.empty(MAX_TRIANGLES, np.int32), np.empty(MAX_TRIANGLES, np.int32)
    ring, shared = np.empty(2 * MAX_TRIANGLES, np.int32), np.empty(2 * MAX_TRIANGLES, np.int32)
    ring_v, shared_v = np.empty(2 * MAX_TRIANGLES, np.int32), np.empty(2 * MAX_TRIANGLES, np.int32)
    seen = np.empty(2 * MAX_TRIANGLES, np.int32)
    slot, stamp, tick = np.zeros(n, np.int32), np.zeros(n, np.int32), 0
    slot_v, stamp_v, tick_v = np.zeros(n, np.int32), np.zeros(n, np.int32), 0
    quadrics = np.zeros((n, 11))
    sum_planes(at, corner, errors, quadrics)
    made, steps = np.empty((n, 2), np.int32), 0
    away = np.zeros(n)
    differs = np.full(n, len(past) == 0, np.bool_)  # from what was around a vertex at that time
    for i in range(len(past)):
        u, v = past[i]
        size = list_around(u, first, after, gone, out)
        if not (locked[u] or differs[u] or differs[v]):
            beyond = -1
            if order_of[u] == ON_LINE:
                tick += 1
                count = list_ring(size, out, corner, ring, shared, slot, stamp, tick)
                for q in range(count):
                    if shared[q] != 2 and ring[q] != v:
                        beyond = ring[q]
            strayed = away[u] + distance_after(at, corner, u, v, beyond, size, out)
            away[v] = max(away[v], strayed)
            move_onto(u, v, size, out, corner, first, after, gone, quadrics)
            made[steps, 0], made[steps, 1] = u, v
            steps += 1
            continue
        differs[u] = differs[v] = True
        for k in range(min(size, MAX_TRIANGLES)):
            differs[corner[following(out[k])]] = differs[corner[preceding(out[k])]] = True
    cost = np.full(n, NEVER, np.int16)
    for u in range(n):
        if not differs[u] or order_of[u] == CORNER or locked[u]:
            continue
        size = list_around(u, first, after, gone, out)
        if not 0 < size <= MAX_TRIANGLES:
            continue
        tick += 1
        count = list_ring(size, out, corner, ring, shared, slot, stamp, tick)
        for j in range(count):
            if order_of[u] == WITHIN or shared[j] != 2:
                cost[u] = min(cost[u], class_of(price_of(quadrics, u, at, ring[j])))
    touched, turn = np.zeros(n, np.int32), 0
    price, order = np.empty(2 * MAX_TRIANGLES), np.empty(2 * MAX_TRIANGLES, np.int32)
    waiting = np.empty(n, np.int32)
    for k in range(CLASSES + 1):
        for _ in range(PASSES if k < CLASSES else LAST):
            waits, turn, done = 0, turn + 1, 0
            for u in range(n):
                if cost[u] <= k:
                    waiting[waits] = u
                    waits += 1
            for i in range(waits):
                u = waiting[i]
                if touched[u] == turn or cost[u] > k:
                    continue
                size = list_around(u, first, after, gone, out)
                if not 0 < size <= MAX_TRIANGLES:
                    cost[u] = NEVER
                    continue
                tick += 1
                count = list_ring(size, out, corner, ring, shared, slot, stamp, tick)
                worst = 0.0
                for j in range(size):
                    c = out[j]
                    worst = max(
                        worst,
                        smallest_angle_cosine(at, u, corner[following(c)], corner[preceding(c)]),
                    )
                allowed = sharpest
                if worst > sharpest:
                    allowed = max(sharpest, 1 - SHARPER * (1 - worst))
                choices = 0
                for j in range(count):
                    if order_of[u] == ON_LINE and shared[j] == 2:
                        continue
                    price[j] = price_of(quadrics, u, at, ring[j])
                    place = choices
                    while place > 0 and price[order[place - 1]] > price[j]:
                        order[place] = order[place - 1]
                        place -= 1
                    order[place] = j
                    choices += 1
                later = NEVER
                for j in range(choices):
                    o = order[j]
                    c = class_of(price[o])
                    if c > k:
                        later = c
                        break
                    v = ring[o]
                    size_v = list_around(v, first, after, gone, out_v)
                    if size_v > MAX_TRIANGLES:
                        continue
                    tick_v += 1
                    count_v = list_ring(
                        size_v, out_v, corner, ring_v, shared_v, slot_v, stamp_v, tick_v
                    )
                    if count + count_v > VALENCE + 4 * (shared[o] - 2):
                        continue
                    common, is_free = 0, True
                    for q in range(count):
                        w = ring[q]
                        seen[q] = w != v and stamp_v[w] == tick_v
                        common += seen[q]
                        if seen[q] and shared[q] != 2 and shared_v[slot_v[w]] != 2:
                            is_free = False  # two lines would fall on one another
                    for q in range(size):
                        x, y = corner[following(out[q])], corner[preceding(out[q])]
                        if x != v and y != v and seen[slot[x]] and seen[slot[y]]:
                            is_free = False  # so would two triangles
                    if not is_free or common != shared[o]:
                        continue
                    if not fits(at, corner, u, v, size, out, allowed):
                        continue
                    beyond = -1
                    if order_of[u] == ON_LINE:
                        for q in range(count):
                            if shared[q] != 2 and ring[q] != v:
                                beyond = ring[q]
                    strayed = away[u] + distance_after(at, corner, u, v, beyond, size, out)
                    if strayed > stray * errors[u]:
                        continue
                    away[v] = max(away[v], strayed)
                    move_onto(u, v, size, out, corner, first, after, gone, quadrics)
                    made[steps, 0], made[steps, 1] = u, v
                    steps += 1
                    later = NEVER
                    if order_of[v] != CORNER and not locked[v]:
                        least = NEVER
                        for q in range(count):
                            if ring[q] != v:
                                least = min(least, class_of(price_of(quadrics, v, at, ring[q])))
                        cost[v] = max(least, k) if least != NEVER else NEVER
                    for q in range(count):
                        w = ring[q]
                        touched[w] = turn
                        if w == v or locked[w] or order_of[w] == CORNER:
                            continue
                        c = max(class_of(price_of(quadrics, w, at, v)), k)
                        cost[w] = min(cost[w], c)
                        if cost[w] == NEVER:  # what was refused may be allowed now
                            cost[w] = min(k + 1, CLASSES)
                    done += 1
                    break
                cost[u] = later
            if done == 0 or (k < CLASSES and (done * 200 < waits or done < 50)):
                break
    return result, gone, made[:steps]
