"""Rings of surfaces and of interfaces: one function for each step in which they differ."""

from stereocell.kernels.compiled import step
from stereocell.kernels.interface_rings import (
    check_sheets_link,
    collect_neighbours,
    collect_triangles,
    join_sheets,
)
from stereocell.kernels.rings import TRIANGLES, Flags, Mesh, Ring
from stereocell.kernels.surface_rings import check_fan_link, collect_fan, join_fans, mark_fan


@step
def is_surface(mesh: Mesh) -> bool:
    """Return whether the mesh is one surface.

    Otherwise it consists of interfaces: the boundaries that two touching objects share.
    """
    return len(mesh.on_line) == 0


@step
def collect_ring(u: int, mesh: Mesh, ring: Ring) -> bool:
    """Write the ring of u; return whether there is space for it and it is not empty."""
    if is_surface(mesh):
        return collect_fan(u, mesh, ring)
    if not collect_triangles(u, mesh, ring):
        return False
    collect_neighbours(ring)
    return ring.sizes[TRIANGLES] > 0


@step
def collect_again(u: int, v: int, mesh: Mesh, ring: Ring) -> int:
    """Write the part of u's ring that moving it onto v needs; return v's number among neighbours.

    For a vertex within an interface these are its triangles and v.
    """
    if not is_surface(mesh) and not mesh.on_line[u]:
        collect_triangles(u, mesh, ring)
        ring.near[0] = v
        return 0
    collect_ring(u, mesh, ring)
    chosen = 0
    while ring.near[chosen] != v:
        chosen += 1
    return chosen


@step
def mark_ring(u: int, mesh: Mesh, ring: Ring, marks: Flags) -> None:
    """Set the marks of all neighbours of the vertex u to True."""
    if is_surface(mesh):
        mark_fan(u, mesh, marks)
    else:
        collect_triangles(u, mesh, ring)
        for k in range(ring.sizes[TRIANGLES]):
            marks[ring.first[k]] = marks[ring.second[k]] = True


@step
def check_link(mesh: Mesh, ring: Ring, chosen: int, other: Ring) -> bool:
    """Return whether moving the ring's vertex onto the chosen neighbour keeps the topology.

    other  working memory for the ring of the neighbour
    """
    if is_surface(mesh):
        return check_fan_link(mesh, ring, chosen)
    return check_sheets_link(mesh, ring, chosen, other)


@step
def move_onto(u: int, chosen: int, mesh: Mesh, ring: Ring, strayed: float) -> None:
    """Merge u into the chosen neighbour. `strayed` is the largest distance of u from the result."""
    v = ring.near[chosen]
    mesh.at[v, 3] = max(mesh.at[v, 3], strayed)
    if is_surface(mesh):
        join_fans(mesh, ring, chosen)
    else:
        join_sheets(mesh, ring, v)
    for p in range(11):
        mesh.quadrics[v, p] += mesh.quadrics[u, p]
    mesh.start[u] = -1
