"""Interfaces between objects: smooth their vertices, and measure objects' volumes at vertices."""

import numpy as np

from stereocell.kernels.compiled import kernel
from stereocell.kernels.half_edges import Ints
from stereocell.kernels.triangles import Points, doubled_area


@kernel
def smooth_interfaces(
    centres: Points, first: Ints, beside: Ints, shares: Points, reach: float
) -> Points:
    """Move vertices by a share of the way to the mean of their neighbours, in turns; return (n, 3).

    centres        float64 (n, 3), start positions
    first, beside  index of each vertex's first neighbour in `beside`, and the total
    shares         float64 (turns,), share of the way in each turn
    reach          largest distance from the start, along each axis
    """
    n = len(centres)
    placed, past = centres.copy(), centres.copy()
    for share in shares:
        placed, past = past, placed
        for v in range(n):
            x, y, z = 0.0, 0.0, 0.0
            for e in range(first[v], first[v + 1]):
                w = beside[e]
                x, y, z = x + past[w, 0], y + past[w, 1], z + past[w, 2]
            one = share / max(first[v + 1] - first[v], 1)
            x = past[v, 0] + (one * x - share * past[v, 0])
            y = past[v, 1] + (one * y - share * past[v, 1])
            z = past[v, 2] + (one * z - share * past[v, 2])
            placed[v, 0] = min(max(x, centres[v, 0] - reach), centres[v, 0] + reach)
            placed[v, 1] = min(max(y, centres[v, 1] - reach), centres[v, 1] + reach)
            placed[v, 2] = min(max(z, centres[v, 2] - reach), centres[v, 2] + reach)
    return placed


@kernel
def bound_objects(at: Points, triangles: Ints, sides: Ints, count: int) -> tuple[Points, Points]:
    """Return the least and the largest corner of each object's box, float64 (count, 3) each."""
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    for t in range(len(triangles)):
        for s in range(2):
            o = sides[t, s]
            for c in range(3):
                for k in range(3):
                    x = at[triangles[t, c], k]
                    low[o, k], high[o, k] = min(low[o, k], x), max(high[o, k], x)
    return low, high


@kernel
def least_of_objects(triangles: Ints, sides: Ints, values: Points, most: float, n: int) -> Points:
    """Return the least value among the objects at each vertex, at most `most`, float64 (n,)."""
    least = np.full(n, most)
    for t in range(len(triangles)):
        value = min(values[sides[t, 0]], values[sides[t, 1]])
        for c in range(3):
            v = triangles[t, c]
            least[v] = min(least[v], value)
    return least


@kernel
def slope_volumes(
    at: Points, triangles: Ints, sides: Ints, row: Ints
) -> tuple[tuple[Ints, Ints, Ints, Points], Points]:
    """Return how objects' volumes change as vertices move.

    row  int32 (objects + 1,), number of each requested object; else -1

    The result is a list of entries for each vertex: `head`, the first entry of each vertex, or -1
    (n,); `after`, the next entry of the same vertex, or -1 (e,); `of`, the row (e,); and the slope
    of the volume (e, 3). The last result is a third of the area of each vertex's triangles (n,).
    """
    n = len(at)
    head, own = np.full(n, -1, np.int32), np.zeros(n)
    after, of = np.empty(4 * n, np.int32), np.empty(4 * n, np.int32)
    slopes, count = np.zeros((4 * n, 3)), 0
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        x, y, z = doubled_area(at, a, b, c)
        third = np.sqrt(x * x + y * y + z * z) / 6
        for k in range(3):
            u, v, w = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            own[u] += third
            # Slope of the cone to the origin. The cone's other sides cancel in a closed surface.
            x = (at[v, 1] * at[w, 2] - at[v, 2] * at[w, 1]) / 6
            y = (at[v, 2] * at[w, 0] - at[v, 0] * at[w, 2]) / 6
            z = (at[v, 0] * at[w, 1] - at[v, 1] * at[w, 0]) / 6
            for s in range(2):
                r = row[sides[t, s]]
                if r < 0:
                    continue
                e = head[u]
                while e >= 0 and of[e] != r:
                    e = after[e]
                if e < 0:
                    if count == len(of):
                        after = np.concatenate((after, np.empty(count, np.int32)))
                        of = np.concatenate((of, np.empty(count, np.int32)))
                        slopes = np.concatenate((slopes, np.zeros((count, 3))))
                    e, count = count, count + 1
                    after[e], of[e], head[u] = head[u], r, e
                sign = 1.0 if s == 0 else -1.0
                slopes[e, 0] += sign * x
                slopes[e, 1] += sign * y
                slopes[e, 2] += sign * z
    return (head, after[:count], of[:count], slopes[:count]), own


@kernel
def couple(
    head: Ints, after: Ints, of: Ints, slopes: Points, light: Points, count: int
) -> tuple[Points, Ints, Points]:
    """Return how a pressure within one object changes the volumes of others.

    head, after, of, slopes  of `slope_volumes`
    light                    float64 (n,), how easily each vertex moves
    count                    number of rows

    The result is the effect of each row on itself (count,), pairs of different rows (m, 2), and the
    effect of each pair (m,). A pair is listed once for each of its vertices.
    """
    own, size = np.zeros(count), 0
    for is_filling in (False, True):
        if is_filling:
            pairs, values, size = np.empty((size, 2), np.int32), np.empty(size), 0
        else:
            pairs, values = np.empty((0, 2), np.int32), np.empty(0)
        for v in range(len(head)):
            if light[v] <= 0:
                continue
            e = head[v]
            while e >= 0:
                f = head[v]
                while f >= 0:
                    if e != f and not is_filling:
                        size += 1
                    elif is_filling:
                        value = 0.0
                        for k in range(3):
                            value += slopes[e, k] * slopes[f, k]
                        value *= light[v]
                        if e == f:
                            own[of[e]] += value
                        else:
                            pairs[size, 0], pairs[size, 1] = of[e], of[f]
                            values[size] = value
                            size += 1
                    f = after[f]
                e = after[e]
    return own, pairs, values


@kernel
def press(
    head: Ints, after: Ints, of: Ints, slopes: Points, light: Points, pressure: Points
) -> Points:
    """Return the move of each vertex under a pressure within each object (n, 3)."""
    moved = np.zeros((len(head), 3))
    for v in range(len(head)):
        e = head[v]
        while e >= 0:
            for k in range(3):
                moved[v, k] += light[v] * pressure[of[e]] * slopes[e, k]
            e = after[e]
    return moved
