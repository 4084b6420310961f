"""Half-edges in records of eight numbers a triangle: three corners, a gap, three twins, a gap.

A walk around a vertex goes from triangle to triangle and waits for memory at each of them. A record
lies within one cache line, with corners and twins together. Half-edge 8 t + k goes from corner k of
triangle t to the next corner.
"""

from stereocell.kernels.compiled import part
from stereocell.kernels.half_edges import Ints

RECORD = 8  # numbers per triangle
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
    """Write the records, int32 (8 m,), and renumber the half-edges of `leaving` accordingly.

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
    """Return how many neighbours of a half-edge's end are stamped, and how many it has in all.

    h  the half-edge; `tick`: value of `stamp` for stamped vertices
    """
    common, valence = 0, 0
    start = edges[h + TWIN]
    g = start
    while True:
        valence += 1
        common += stamp[edges[ahead(g)]] == tick
        onward = edges[behind(g) + TWIN]
        if onward < 0:  # a border: count its other end, then go around the other way
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
    """Move the start of half-edge h onto its end, v, and remove the two triangles at this edge.

    out   half-edges that leave the start
    size  number of these half-edges
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
