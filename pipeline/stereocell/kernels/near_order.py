"""An order of vertices and triangles in which near ones follow each other.

The order follows a curve through cells of space (Z-order). A loop over part of the order then finds
the neighbours in the cache.

References
G. M. Morton, "A computer oriented geodetic data base and a new technique in file sequencing",
IBM, 1966.
"""

import numpy as np

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.half_edges import Ints
from stereocell.kernels.triangles import Points

BITS = 6  # bits of a cell's index along an axis: 64 cells along the longest side of the box


@part
def _spread(place: int) -> int:
    """Return the number with two zeros inserted before each of its bits."""
    code = 0
    for bit in range(BITS):
        code |= (place >> bit & 1) << (3 * bit)
    return code


@part
def _sort(keys: Ints, count: int) -> Ints:
    """Return the indices of the keys in rising order of key; equal keys keep their order."""
    first = np.zeros(count + 1, np.int32)
    for key in keys:
        first[key + 1] += 1
    for key in range(count):
        first[key + 1] += first[key]
    order = np.empty(len(keys), np.int32)
    for i in range(len(keys)):
        order[first[keys[i]]] = i
        first[keys[i]] += 1
    return order


@kernel
def order_vertices(at: Points) -> Ints:
    """Return the vertices, int32 (n,), cell by cell; within a cell they keep their order.

    at  float64 (n, 3)
    """
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for v in range(len(at)):
        for k in range(3):
            low[k], high[k] = min(low[k], at[v, k]), max(high[k], at[v, k])
    longest = max(high[0] - low[0], max(high[1] - low[1], high[2] - low[2]))
    scale = 2**BITS / longest if longest > 0 else 0.0
    codes, keys = np.empty(2**BITS, np.int32), np.zeros(len(at), np.int32)
    for place in range(2**BITS):
        codes[place] = _spread(place)
    for v in range(len(at)):
        for k in range(3):
            place = min(int((at[v, k] - low[k]) * scale), 2**BITS - 1)
            keys[v] |= codes[place] << k
    return _sort(keys, 8**BITS)


@kernel
def order_triangles(triangles: Ints, place: Ints) -> Ints:
    """Return the triangles, int32 (m,), in the order of their first vertices.

    triangles  int32 (m, 3)
    place      int32 (n,), index of each vertex in the order of vertices
    """
    keys = np.empty(len(triangles), np.int32)
    for t in range(len(triangles)):
        a, b, c = place[triangles[t, 0]], place[triangles[t, 1]], place[triangles[t, 2]]
        keys[t] = min(a, min(b, c))
    return _sort(keys, len(place))
