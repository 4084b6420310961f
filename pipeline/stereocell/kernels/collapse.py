r"""Half-edge collapses: a vertex u moves onto a neighbour v, and their edge's triangles vanish.

       r2------r1                r2------r1
      /  \  1  /  \             /  `-. 1   \        ring of u: triangles 0 ... 5, and their
     / 2  \   / 0  \           /  2   `-.   \       outer corners v, r1 ... r5, its neighbours
   r3------ u ----- v   ->   r3----------`-- v
     \ 3  /   \ 5  /           \  3   .-'   /       triangles 0 and 5 are removed,
      \  /  4  \  /             \  .-' 4   /        the others have v in place of u
       r4------r5                r4------r5

The price of a collapse is the quadric error of its target (kernels/quadrics.py). Cheap collapses
come first, in a few classes of cost rather than by a queue. A collapse is allowed only if all of
these hold:

- The two ends share exactly the neighbours that their edge has (the link condition), which keeps
  the topology. In a surface these are two neighbours.
- Each triangle turns by less than 60 degrees. A sliver of a surface may turn further if it then
  faces as its surroundings do.
- No triangle gets sharper than the bound. If triangles around u are sharper already, the bound is
  .6 of the sharpest angle.
- No triangle comes to lie in a cut plane.
- A vertex of a cap, the flat end of a body, moves only within its plane. So each cap stays flat,
  and the caps of several channels stay in their order.
- The vertex, and all vertices that were merged into it, are near the new triangles. The distances
  of successive collapses are added.

Interfaces between objects share lines and corners. A vertex within an interface moves onto any
neighbour. A vertex of a line moves only along the line and stays near it. A corner stays.

A surface is processed block by block, each of some thousand vertices near one another. At last it
is processed as a whole, for collapses that are possible at the seams of the blocks. Most of the
time is spent on waiting for memory: passes over the whole mesh, in the order of its planes, take
nearly twice as long.

If triangles cross after a try, more vertices are locked and the mesh is simplified again. The
earlier collapses are replayed without checks, except around newly locked vertices. The result
differs only there, and takes a third of the time.

References
M. Garland & P. S. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
doi:10.1145/258734.258849
H. Hoppe, "Progressive meshes", SIGGRAPH 1996. doi:10.1145/237170.237216
T. K. Dey, H. Edelsbrunner, S. Guha & D. V. Nekhayev, "Topology preserving edge contraction",
Publications de l'Institut Mathematique 66, 1999.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import in_place, step
from stereocell.kernels.edge_records import RECORD
from stereocell.kernels.half_edges import Ints
from stereocell.kernels.interface_rings import CORNER, ON_LINE, fill_sheets
from stereocell.kernels.mesh_rings import (
    check_link,
    collect_again,
    collect_ring,
    is_surface,
    mark_ring,
    move_onto,
)
from stereocell.kernels.near_order import order_triangles, order_vertices
from stereocell.kernels.quadrics import CLASSES, NEVER, SURE, add_plane, class_of, price_of
from stereocell.kernels.ring_checks import check_normals, measure_ring, measure_stray
from stereocell.kernels.rings import NEIGHBOURS, Flags, Mesh, Ring, make_mesh, make_ring
from stereocell.kernels.surface_rings import fill_fans, find_cheapest_in_fan, stamp_fan
from stereocell.kernels.triangle_rows import rename, rename_back
from stereocell.kernels.triangles import Points

PASSES = 4  # largest number of passes over one class of cost; for the last class, it is LAST
LAST = 40
# Square of .6. If triangles around a vertex are sharper than the bound, a collapse may leave .6 of
# their sharpest angle. The code compares 1 - cos, which grows with the square of an angle.
SHARPER = 0.36
BLOCK = 4096  # number of vertices, near one another, that are processed together


class Limits(NamedTuple):
    """The bounds that a collapse must keep, and the number of vertices in a block."""

    # Largest distance of a vertex from the result, summed over collapses; multiple of its error
    stray: float
    sharpest: float  # cosine of the smallest angle that a triangle may have
    block: int  # vertices that go through all classes of cost before the next ones do


class Work(NamedTuple):
    """Arrays that the collapses of one mesh of n vertices share."""

    ring: Ring  # ring of the vertex that may move
    other: Ring  # ring of the neighbour onto which it may move
    costs: NDArray[np.int16]  # (n,), class of cost of each vertex
    touched: Ints  # (n,), the last pass in which a vertex's ring has changed
    waiting: Ints  # (n + 1,), vertices of one pass
    differs: Flags  # (n,), vertices whose ring differs from the ring in the earlier try
    made: Ints  # (n, 2), collapses: a vertex, and the one onto which it has moved


def collapse(
    at: Points,
    triangles: Ints,
    locked: Flags,
    planes: NDArray[np.uint8],
    errors: Points,
    stray: float,
    sharpest: float,
    past: Ints,
    caps: NDArray[np.uint8] | None = None,
) -> tuple[Ints, Flags, Ints]:
    """Collapse a surface; return its triangles, a mask of those that are left, and the collapses.

    at         float64 (n, 3), near the origin, because quadrics lose digits far from it
    triangles  int32 (m, 3)
    locked     bool (n,), vertices that stay. Vertices of borders stay as well, and so do those
               whose triangles do not form a single fan.
    planes     uint8 (n,), a bit for each cut plane that a vertex lies in
    errors     float64 (n,), largest root of the mean squared distance from the planes; equal for
               all vertices of a connected component
    stray, sharpest  see `Limits`
    past       int32 (k, 2), collapses of an earlier try with fewer locked vertices; (0, 2): none
    caps       uint8 (n,), a bit for each cap that a vertex lies in; None: there are no caps
    result     triangles int32 (m, 3) by the vertices that are left; bool (m,), triangles that are
               left; int32 (k, 2), collapses: a vertex, and the one onto which it has moved
    """
    n, m = len(at), len(triangles)
    limits = Limits(stray, sharpest, BLOCK)
    if n <= BLOCK:
        mesh = make_mesh(n, m, planes=planes, caps=caps, errors=errors)
        mesh.at[:, :3] = at
        fill_fans(mesh, triangles, locked)
        corners, left, made = _run(mesh, past, limits)
        return np.ascontiguousarray(corners), left, made
    order = order_vertices(at)
    place = np.empty(n, np.int32)
    place[order] = np.arange(n, dtype=np.int32)
    turns = order_triangles(triangles, place)
    mesh = make_mesh(
        n,
        m,
        planes=planes[order],
        caps=None if caps is None else caps[order],
        errors=errors[order],
    )
    for axis in range(3):
        mesh.at[:, axis] = at[order, axis]
    fill_fans(mesh, rename(place, triangles, turns), locked[order])
    corners, left, made = _run(mesh, place[past], limits)
    result, is_left = rename_back(order, corners, turns, left)
    return result, is_left, order[made]


def collapse_interfaces(
    at: Points,
    triangles: Ints,
    locked: Flags,
    errors: Points,
    stray: float,
    sharpest: float,
    orders: NDArray[np.int8],
    past: Ints,
) -> tuple[Ints, Flags, Ints]:
    """Collapse the triangles of all interfaces between objects; see `collapse` for the result.

    errors  float64 (n,), may differ between neighbours
    orders  int8 (n,), see `find_orders`; corners stay, and vertices of lines stay on their lines
    """
    mesh = make_mesh(len(at), len(triangles), on_line=orders == ON_LINE, errors=errors)
    mesh.at[:, :3] = at
    mesh.stays[:] = locked | (orders == CORNER)
    fill_sheets(mesh, triangles)
    corners, left, made = _run(mesh, past, Limits(stray, sharpest, len(at)))
    return np.ascontiguousarray(corners), left, made


def _run(mesh: Mesh, past: Ints, limits: Limits) -> tuple[Ints, Flags, Ints]:
    """Return the result of `collapse` for a surface or interfaces whose edges are written.

    The triangles are a view of the mesh's edges.
    """
    n, is_a_surface = len(mesh.at), len(mesh.on_line) == 0
    work = Work(
        ring=make_ring(n, is_surface=is_a_surface),
        other=make_ring(0 if is_a_surface else n, is_surface=is_a_surface),
        costs=np.full(n, NEVER, np.int16),
        touched=np.zeros(n, np.int32),
        waiting=np.empty(n + 1, np.int32),
        differs=np.full(n, len(past) == 0),
        made=np.empty((n, 2), np.int32),
    )
    count = collapse_in_place(mesh, past, work, limits)
    return mesh.edges.reshape(-1, RECORD)[:, :3], mesh.is_left, work.made[:count]


@in_place
def collapse_in_place(mesh: Mesh, past: Ints, work: Work, limits: Limits) -> int:
    """Collapse a mesh as far as its errors allow; return the number of collapses."""
    for h in range(0, len(mesh.edges), RECORD):
        a, b, c = mesh.edges[h], mesh.edges[h + 1], mesh.edges[h + 2]
        add_plane(mesh.at, a, b, c, mesh.errors, mesh.quadrics)
    made = replay(mesh, past, work)
    find_costs(mesh, work)
    n, block, turn = len(mesh.at), limits.block, 0
    blocks = -(-n // block) if n > block and len(past) == 0 else 0
    for number in range(blocks + 1):  # after the blocks, the whole mesh
        is_last = number == blocks
        low, high = (0, n) if is_last else (number * block, min((number + 1) * block, n))
        for limit in range(CLASSES + 1):
            for _ in range(PASSES if limit < CLASSES else LAST):
                turn += 1
                waits = list_waiting(low, high, limit, work)
                before = made
                for i in range(waits):
                    u = work.waiting[i]
                    if work.touched[u] == turn or work.costs[u] > limit:
                        continue
                    v = try_collapse(u, limit, mesh, work, limits)
                    if v >= 0:
                        work.made[made, 0], work.made[made, 1] = u, v
                        made += 1
                        update_costs(v, limit, mesh, work, turn)
                done = made - before
                few = done * 200 < waits or (is_last and done < 50)
                if done == 0 or (limit < CLASSES and few):
                    break
    return made


@step
def list_waiting(low: int, high: int, limit: int, work: Work) -> int:
    """Write the vertices whose class of cost is at most the limit; return their number."""
    waits = 0
    for u in range(low, high):
        work.waiting[waits] = u
        waits += work.costs[u] <= limit
    return waits


@step
def replay(mesh: Mesh, past: Ints, work: Work) -> int:
    """Repeat the collapses of an earlier try where no ring differs; return their number."""
    ring, differs, made = work.ring, work.differs, 0
    for i in range(len(past)):
        u, v = past[i, 0], past[i, 1]
        if mesh.stays[u] or differs[u] or differs[v]:
            differs[u] = differs[v] = True
            mark_ring(u, mesh, ring, differs)
            continue
        chosen = collect_again(u, v, mesh, ring)
        move_onto(u, chosen, mesh, ring, measure_stray(u, v, mesh, ring))
        work.made[made, 0], work.made[made, 1] = u, v
        made += 1
    return made


@step
def find_costs(mesh: Mesh, work: Work) -> None:
    """Write the class of cost of each vertex whose ring differs."""
    for u in range(len(mesh.at)):
        if not work.differs[u] or mesh.stays[u]:
            continue
        if is_surface(mesh):
            price = find_cheapest_in_fan(u, mesh, SURE / CLASSES**2)
            work.costs[u] = class_of(price)
        elif collect_ring(u, mesh, work.ring):
            chosen = price_neighbours(u, mesh, work.ring)
            work.costs[u] = class_of(work.ring.price[chosen])


@step
def try_collapse(u: int, limit: int, mesh: Mesh, work: Work, limits: Limits) -> int:
    """Move u onto its cheapest neighbour for which the collapse is allowed.

    limit  highest class of cost that is allowed now
    result this neighbour, or -1 if there is none
    """
    ring, costs = work.ring, work.costs
    costs[u] = NEVER
    if not collect_ring(u, mesh, ring):
        return -1
    chosen = price_neighbours(u, mesh, ring)
    costs[u] = class_of(ring.price[chosen])
    if costs[u] > limit:
        return -1
    mean, worst = measure_ring(u, mesh, ring, by_area=is_surface(mesh))
    allowed = limits.sharpest
    if worst > allowed:
        allowed = max(allowed, 1 - SHARPER * (1 - worst))
    form = mean, allowed
    if is_surface(mesh):
        stamp_fan(ring)
    while costs[u] <= limit:
        v = ring.near[chosen]
        if check_normals(u, v, mesh, ring, form) and check_link(mesh, ring, chosen, work.other):
            strayed = measure_stray(u, v, mesh, ring)
            if strayed <= limits.stray * mesh.errors[u]:
                move_onto(u, chosen, mesh, ring, strayed)
                costs[u] = NEVER
                return v
        ring.price[chosen] = np.inf
        chosen = find_cheapest(ring)
        costs[u] = class_of(ring.price[chosen])
    return -1


@step
def update_costs(v: int, limit: int, mesh: Mesh, work: Work, turn: int) -> None:
    """Write new classes of cost for v, onto which the ring's vertex has moved, and its ring."""
    ring, costs = work.ring, work.costs
    if not mesh.stays[v]:
        costs[v] = find_cost_after(v, limit, mesh, ring)
    for j in range(ring.sizes[NEIGHBOURS]):
        w = ring.near[j]
        work.touched[w] = turn
        if w == v or mesh.stays[w] or costs[w] <= limit:
            continue
        cost = max(class_of(price_of(mesh.quadrics, w, mesh.at, v)), limit)
        costs[w] = min(costs[w], cost)
        if costs[w] == NEVER:  # a collapse that was refused before may be allowed now
            costs[w] = min(limit + 1, CLASSES)


@step
def find_cost_after(v: int, limit: int, mesh: Mesh, ring: Ring) -> int:
    """Return the class of cost of v, onto which the ring's vertex has moved."""
    if is_surface(mesh):
        enough = SURE * min(1.0, ((limit + 1) / CLASSES) ** 2)
        return class_of(find_cheapest_in_fan(v, mesh, enough))
    least = NEVER
    for j in range(ring.sizes[NEIGHBOURS]):
        if ring.near[j] != v:
            least = min(least, class_of(price_of(mesh.quadrics, v, mesh.at, ring.near[j])))
    return least


@step
def price_neighbours(u: int, mesh: Mesh, ring: Ring) -> int:
    """Write the price of moving u onto each neighbour; return the index of the cheapest neighbour.

    The price is infinite where u would leave its line or its cap.
    """
    cheapest, least, own = 0, np.inf, mesh.caps[u]
    for j in range(ring.sizes[NEIGHBOURS]):
        price = price_of(mesh.quadrics, u, mesh.at, ring.near[j])
        if not is_surface(mesh) and mesh.on_line[u] and ring.shared[j] == 2:
            price = np.inf
        if own & ~mesh.caps[ring.near[j]]:
            price = np.inf
        ring.price[j] = price
        if price < least:
            cheapest, least = j, price
    return cheapest


@step
def find_cheapest(ring: Ring) -> int:
    """Return the index of the neighbour with the least price; of equal ones, the first."""
    cheapest = 0
    for j in range(1, ring.sizes[NEIGHBOURS]):
        if ring.price[j] < ring.price[cheapest]:
            cheapest = j
    return cheapest
