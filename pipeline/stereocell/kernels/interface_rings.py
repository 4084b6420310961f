"""Rings of interfaces between objects: sheets that share edges and vertices.

Three or more interfaces meet in a line, and lines meet in a corner. The half-edges that leave a
vertex form a list: the TWIN of each is the next one that leaves the same vertex, or -1.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import in_place, step
from stereocell.kernels.edge_records import RECORD, TWIN, ahead, behind
from stereocell.kernels.half_edges import Ints
from stereocell.kernels.rings import (
    MAX_TRIANGLES,
    NEIGHBOURS,
    STAMP,
    TRIANGLES,
    Mesh,
    Ring,
    make_mesh,
    make_ring,
)
from stereocell.kernels.surface_rings import VALENCE

WITHIN, ON_LINE, CORNER = 0, 1, 2  # kinds of vertices: within one interface, on a line, in a corner


def find_orders(triangles: Ints, n: int) -> NDArray[np.int8]:
    """Return the kind of each of n vertices: WITHIN, ON_LINE or CORNER, int8 (n,)."""
    orders = np.full(n, CORNER, np.int8)
    _write_orders(triangles, make_mesh(n, len(triangles)), make_ring(n, is_surface=False), orders)
    return orders


@in_place
def _write_orders(triangles: Ints, mesh: Mesh, ring: Ring, orders: NDArray[np.int8]) -> None:
    fill_sheets(mesh, triangles)
    for u in range(len(orders)):
        if collect_triangles(u, mesh, ring) and ring.sizes[TRIANGLES] > 0:
            collect_neighbours(ring)
            orders[u] = _find_order(ring)


@step
def _find_order(ring: Ring) -> int:
    """Return the kind of the ring's vertex: WITHIN, ON_LINE or CORNER."""
    ends, degree, seen, count = 0, 0, ring.marks, ring.sizes[NEIGHBOURS]
    for j in range(count):
        if ring.shared[j] < 2:
            return CORNER
        if ring.shared[j] != 2:
            if ends and ring.shared[j] != degree:
                return CORNER
            ends, degree = ends + 1, ring.shared[j]
    if ends not in (0, 2):
        return CORNER
    # Neighbours that are not connected belong to sheets that touch only in this point.
    for j in range(count):
        seen[j] = j == 0
    changes, known = True, 1
    while changes:
        changes = False
        for k in range(ring.sizes[TRIANGLES]):
            a, b = ring.slot[ring.first[k]], ring.slot[ring.second[k]]
            if seen[a] != seen[b]:
                seen[a], seen[b] = 1, 1
                known += 1
                changes = True
    if known != count:
        return CORNER
    return ON_LINE if ends else WITHIN


@in_place
def fill_sheets(mesh: Mesh, triangles: Ints) -> None:
    """Write the half-edges of interfaces into the mesh."""
    for v in range(len(mesh.start)):
        mesh.start[v] = -1
    for t in range(len(triangles) - 1, -1, -1):
        for k in range(2, -1, -1):
            v, h = triangles[t, k], RECORD * t + k
            mesh.edges[h], mesh.edges[h + TWIN] = v, mesh.start[v]
            mesh.start[v] = h


@step
def collect_triangles(u: int, mesh: Mesh, ring: Ring) -> bool:
    """Write the triangles around u into the ring; return whether there is space for all."""
    size, h = 0, mesh.start[u]
    while h >= 0:
        if mesh.is_left[h // RECORD]:
            if size == MAX_TRIANGLES:
                ring.sizes[TRIANGLES] = size
                return False
            ring.out[size], ring.first[size] = h, mesh.edges[ahead(h)]
            ring.second[size] = mesh.edges[behind(h)]
            size += 1
        h = mesh.edges[h + TWIN]
    ring.sizes[TRIANGLES] = size
    return True


@step
def collect_neighbours(ring: Ring) -> None:
    """Write and stamp the neighbours, with the number of triangles at the edge to each."""
    count, stamp = 0, ring.sizes[STAMP] + 1
    for k in range(ring.sizes[TRIANGLES]):
        for v in (ring.first[k], ring.second[k]):
            if ring.stamp[v] != stamp:
                ring.stamp[v], ring.slot[v] = stamp, count
                ring.near[count], ring.shared[count] = v, 0
                count += 1
            ring.shared[ring.slot[v]] += 1
    ring.sizes[NEIGHBOURS], ring.sizes[STAMP] = count, stamp


@step
def check_sheets_link(mesh: Mesh, ring: Ring, chosen: int, other: Ring) -> bool:
    """Return whether the ends of an edge share exactly the neighbours that the edge has.

    chosen  number of the edge's far end among the neighbours
    other   working memory for the ring of the far end
    """
    v, shared, seen = ring.near[chosen], ring.shared[chosen], ring.marks
    if not collect_triangles(v, mesh, other):
        return False
    collect_neighbours(other)
    if ring.sizes[NEIGHBOURS] + other.sizes[NEIGHBOURS] > VALENCE + 4 * (shared - 2):
        return False
    common, is_free, stamp = 0, True, other.sizes[STAMP]
    for j in range(ring.sizes[NEIGHBOURS]):
        w = ring.near[j]
        seen[j] = w != v and other.stamp[w] == stamp
        common += seen[j]
        if seen[j] and ring.shared[j] != 2 and other.shared[other.slot[w]] != 2:
            is_free = False  # collapsing this edge would put two lines on top of each other
    for k in range(ring.sizes[TRIANGLES]):
        x, y = ring.first[k], ring.second[k]
        if x != v and y != v and seen[ring.slot[x]] and seen[ring.slot[y]]:
            is_free = False  # collapsing this edge would put two triangles on top of each other
    return is_free and common == shared


@step
def find_beyond(v: int, ring: Ring) -> int:
    """Return the neighbour on the line of the ring's vertex that is not v; -1: there is none."""
    beyond = -1
    for j in range(ring.sizes[NEIGHBOURS]):
        if ring.shared[j] != 2 and ring.near[j] != v:
            beyond = ring.near[j]
    return beyond


@step
def join_sheets(mesh: Mesh, ring: Ring, v: int) -> None:
    """Replace the ring's vertex by v, and remove the triangles that have both."""
    last = mesh.start[v]
    while mesh.edges[last + TWIN] >= 0:
        last = mesh.edges[last + TWIN]
    for k in range(ring.sizes[TRIANGLES]):
        h = ring.out[k]
        if ring.first[k] == v or ring.second[k] == v:
            mesh.is_left[h // RECORD] = False
            continue
        mesh.edges[h] = v
        mesh.edges[last + TWIN], mesh.edges[h + TWIN] = h, -1
        last = h
    h, before = mesh.start[v], -1  # remove the triangles that are gone from the list of v
    while h >= 0:
        onward = mesh.edges[h + TWIN]
        if mesh.is_left[h // RECORD]:
            before = h
        elif before < 0:
            mesh.start[v] = onward
        else:
            mesh.edges[before + TWIN] = onward
        h = onward
