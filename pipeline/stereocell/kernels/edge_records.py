"""Half-edges in records: eight numbers a triangle, its three corners, a gap, three twins, a gap.

A walk round a vertex goes from triangle to triangle, and waits for memory at each one. A record
lies within one line of the cache, corners and twins together. Half-edge 8 t + k goes from corner k
of triangle t to the next one.
"""

from stereocell.kernels.compiled import part
from stereocell.kernels.half_edges import Ints

RECORD = 8  # numbers a triangle
TWIN = 4  # numbers from a half-edge's start to its twin


@part
def ahead(h: int) -> int:
    """Return the half-edge after this one in its triangle."""
    return h + 1 if h & 7 < 2 else h - 2


@part
def behind(h: int) -> int:
    """Return the half-edge before this one in its triangle."""
    return h - 1 if h & 7 > 0 else h + 2


@part
def fill_records(triangles: Ints, twins: Ints, leaving: Ints, edges: Ints) -> None:
    """Write the records, int32 (8 m,), and in place of `leaving` its half-edges as they are there.

    triangles  int32 (m, 3)
    twins      int32 (3 m,), see `match_twins`
    leaving    int32 (n,), an outgoing half-edge of each vertex, or -1
    """
    for t in range(len(triangles)):
        for k in range(3):
            edges[RECORD * t + k] = triangles[t, k]
            h = twins[3 * t + k]
            edges[RECORD * t + k + TWIN] = RECORD * (h // 3) + h % 3 if h >= 0 else h
    for v in range(len(leaving)):
        h = leaving[v]
        if h >= 0:
            leaving[v] = RECORD * (h // 3) + h % 3


@part
def count_common(h: int, edges: Ints, stamp: Ints, tick: int) -> tuple[int, int]:
    """Return how many neighbours of the target carry the stamp, and how many it has.

    h  the half-edge to the target
    """
    common, valence = 0, 0
    start = edges[h + TWIN]
    g = start
    while True:
        valence += 1
        common += stamp[edges[ahead(g)]] == tick
        onward = edges[behind(g) + TWIN]
        if onward < 0:  # the border: its other end, and then the other way round
            valence += 1
            common += stamp[edges[behind(g)]] == tick
            g = start
            while edges[g + TWIN] >= 0:
                g = ahead(edges[g + TWIN])
                valence += 1
                common += stamp[edges[ahead(g)]] == tick
            return common, valence
        g = onward
        if g == start:
            return common, valence


@part
def join(h: int, v: int, out: Ints, size: int, edges: Ints, leaving: Ints) -> None:
    """Move the start of half-edge h onto its end, v, and take its two triangles out.

    out  the half-edges that leave the start, and their number
    """
    g = edges[h + TWIN]
    a, b = edges[behind(h)], edges[behind(g)]
    for k in range(size):
        edges[out[k]] = v
    left, right = edges[ahead(h) + TWIN], edges[behind(h) + TWIN]
    if left >= 0:
        edges[left + TWIN] = right
    edges[right + TWIN] = left
    upper, lower = edges[ahead(g) + TWIN], edges[behind(g) + TWIN]
    edges[upper + TWIN] = lower
    if lower >= 0:
        edges[lower + TWIN] = upper
    leaving[v], leaving[a], leaving[b] = right, ahead(right), upper
