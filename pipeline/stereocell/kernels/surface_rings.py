"""Rings of a surface: each edge has two triangles, and the triangles of a vertex form one fan."""

import numpy as np

from stereocell.kernels.compiled import kernel, step
from stereocell.kernels.edge_records import RECORD, TWIN, ahead, behind, count_common, fill_records
from stereocell.kernels.edge_records import join as join_records
from stereocell.kernels.half_edges import Ints, count_fans, find_fixed, match_twins
from stereocell.kernels.quadrics import price_of
from stereocell.kernels.rings import MAX_NEIGHBOURS, NEIGHBOURS, STAMP, TRIANGLES, Flags, Mesh, Ring

VALENCE = 24  # largest number of neighbours that the two ends of an edge have together


@kernel
def fill_fans(mesh: Mesh, triangles: Ints, locked: Flags) -> None:
    """Write the half-edges of a surface, and mark vertices that stay: locked or on a border."""
    twins = match_twins(triangles, len(mesh.start))
    start, valence = count_fans(triangles, twins, len(mesh.start))
    stays = find_fixed(locked, triangles.ravel(), twins, valence)
    fill_records(triangles, twins, start, mesh.edges)
    for u in range(len(start)):  # a slice would take seconds to compile, see `copying`
        mesh.stays[u], mesh.start[u] = stays[u], start[u]


@step
def collect_fan(u: int, mesh: Mesh, ring: Ring) -> bool:
    """Write the ring of u, which is not on a border; return whether there is space for it."""
    size, start = 0, mesh.start[u]
    h = start
    while size < MAX_NEIGHBOURS:
        ring.out[size], ring.first[size] = h, mesh.edges[ahead(h)]
        ring.second[size] = mesh.edges[behind(h)]
        size += 1
        h = mesh.edges[behind(h) + TWIN]
        if h == start:
            ring.sizes[TRIANGLES] = ring.sizes[NEIGHBOURS] = size
            return True
    return False


@step
def stamp_fan(ring: Ring) -> None:
    """Give the next stamp to the neighbours."""
    ring.sizes[STAMP] += 1
    for k in range(ring.sizes[TRIANGLES]):
        ring.stamp[ring.first[k]] = ring.sizes[STAMP]


@step
def mark_fan(u: int, mesh: Mesh, marks: Flags) -> None:
    """Set the marks of all neighbours of the vertex u, which is not on a border, to True."""
    start = mesh.start[u]
    h = start
    while True:
        marks[mesh.edges[ahead(h)]] = True
        h = mesh.edges[behind(h) + TWIN]
        if h == start:
            return


@step
def check_fan_link(mesh: Mesh, ring: Ring, chosen: int) -> bool:
    """Return whether an edge's ends have two common neighbours, and at most VALENCE in all.

    ring    ring whose neighbours are stamped, see `stamp_fan`
    chosen  number of the edge's far end among the neighbours
    """
    common, others = count_common(ring.out[chosen], mesh.edges, ring.stamp, ring.sizes[STAMP])
    return common == 2 and 7 <= others + ring.sizes[TRIANGLES] <= VALENCE


@step
def join_fans(mesh: Mesh, ring: Ring, chosen: int) -> None:
    """Replace the ring's vertex by the chosen neighbour, and remove two triangles."""
    h = ring.out[chosen]
    mesh.is_left[h // RECORD] = mesh.is_left[mesh.edges[h + TWIN] // RECORD] = False
    v = ring.first[chosen]
    join_records(h, v, ring.out, ring.sizes[TRIANGLES], mesh.edges, mesh.start)


@step
def find_cheapest_in_fan(u: int, mesh: Mesh, enough: float) -> float:
    """Return the least price of u's collapses, or any below `enough`. u is not on a border."""
    start = mesh.start[u]
    best, h = np.inf, start
    while True:
        best = min(best, price_of(mesh.quadrics, u, mesh.at, mesh.edges[ahead(h)]))
        h = mesh.edges[behind(h) + TWIN]
        if h == start or best < enough:
            return best
