"""Thin out the vertices that a surface has on a plane where it is cut.

The surface continues on both sides of the plane. A vertex in the plane moves onto its neighbour
along the curve in which the plane cuts the surface. So each side alone is as valid as the whole.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import in_place, part, step
from stereocell.kernels.edge_records import RECORD, TWIN, ahead, behind
from stereocell.kernels.half_edges import Ints
from stereocell.kernels.ring_checks import check_normals, measure_ring
from stereocell.kernels.rings import TRIANGLES, Mesh, Ring, make_mesh, make_ring
from stereocell.kernels.surface_rings import (
    check_fan_link,
    collect_fan,
    fill_fans,
    join_fans,
    stamp_fan,
)
from stereocell.kernels.triangles import Points

STEPS = 4  # number of steps in which the error grows to its bound, so that flat parts go first
PASSES = 6  # largest number of passes over one step
# Square of .32. If triangles around a vertex are sharper than the bound, a move may leave .32 of
# their sharpest angle. The code compares 1 - cos, which grows with the square of an angle.
SHARPER = 0.1


@part
def _distance_to_segment(at: Points, u: int, p: int, n: int) -> float:
    """Return the distance of u from the segment pn."""
    along, square = 0.0, 0.0
    for k in range(3):
        side = at[n, k] - at[p, k]
        along += (at[u, k] - at[p, k]) * side
        square += side * side
    share = min(max(along / square, 0.0), 1.0) if square > 0 else 0.0
    away = 0.0
    for k in range(3):
        away += (at[u, k] - at[p, k] - share * (at[n, k] - at[p, k])) ** 2
    return np.sqrt(away)


@part
def _is_on_curve(h: int, edges: Ints, sides: NDArray[np.int8]) -> bool:
    """Return whether a half-edge that starts in the plane runs along the curve."""
    g = edges[h + TWIN]
    if g < 0 or sides[edges[ahead(h)]] != 0:
        return False
    return sides[edges[behind(h)]] * sides[edges[behind(g)]] < 0


@part
def _farthest(at: Points, u: int, p: int, q: int, curves: Ints, leaving: Ints) -> float:
    """Return the largest distance from the segment pq, of u and of the vertices merged around it.

    curves   int32 (n, 2), the two neighbours that each vertex had along the curve
    leaving  negative for vertices that were merged
    """
    most = _distance_to_segment(at, u, p, q)
    for k in range(2):
        past, here = u, curves[u, k]
        while leaving[here] < 0:
            most = max(most, _distance_to_segment(at, here, p, q))
            onward = curves[here, 0] if curves[here, 1] == past else curves[here, 1]
            past, here = here, onward
    return most


def thin_rim(
    at: Points,
    triangles: Ints,
    sides: NDArray[np.int8],
    planes: NDArray[np.uint8],
    locked: NDArray[np.bool_],
    error: float,
    sharpest: float,
) -> Ints:
    """Return the vertex onto which each vertex moves, int32 (n,); most of them are themselves.

    at         float64 (n, 3)
    triangles  int32 (m, 3); vertices of borders stay
    sides      int8 (n,): -1 or 1 beside the plane, 0 in the plane
    planes     uint8 (n,), a bit for each cut plane that a vertex lies in, including this one
    locked     bool (n,), vertices that stay
    error      largest distance of a vertex from the remaining curve
    sharpest   cosine of the smallest angle that a triangle may have; the angle may be smaller where
               triangles are sharper already
    """
    n = len(at)
    mesh = make_mesh(n, len(triangles), planes=planes)
    mesh.at[:, :3] = at
    fill_fans(mesh, triangles, locked | (sides != 0))
    curves, target = np.full((n, 2), -1, np.int32), np.arange(n, dtype=np.int32)
    ring, touched = make_ring(n, is_surface=True), np.zeros(n, np.int32)
    thin_in_place(mesh, ring, sides, curves, target, touched, error, sharpest)
    return target


@in_place
def thin_in_place(
    mesh: Mesh,
    ring: Ring,
    sides: NDArray[np.int8],
    curves: Ints,
    target: Ints,
    touched: Ints,
    error: float,
    sharpest: float,
) -> None:
    """Write the vertex onto which each vertex moves; see `thin_rim`.

    curves   int32 (n, 2), written: the two neighbours that each vertex had along the curve
    touched  int32 (n,), zeros; the last pass in which a vertex's ring has changed
    """
    find_curves(mesh, sides, curves)
    turn = 0
    for number in range(1, STEPS + 1):
        bound = error * number / STEPS
        for _ in range(PASSES):
            turn, done = turn + 1, 0
            for u in range(len(mesh.at)):
                if mesh.stays[u] or mesh.start[u] < 0 or touched[u] == turn:
                    continue
                before, after = find_on_curve(u, mesh, ring, sides)
                if before < 0:
                    continue
                p, q = ring.first[after], ring.first[before]
                if _farthest(mesh.at, u, p, q, curves, mesh.start) > bound:
                    continue
                mean, worst = measure_ring(u, mesh, ring, by_area=True)
                allowed = max(sharpest, 1 - SHARPER * (1 - worst))
                stamp_fan(ring)
                for chosen in (after, before):
                    v = ring.first[chosen]
                    if not check_fan_link(mesh, ring, chosen):
                        continue
                    if not check_normals(u, v, mesh, ring, (mean, allowed)):
                        continue
                    touched[p] = touched[q] = turn
                    join_fans(mesh, ring, chosen)
                    mesh.start[u], target[u] = -1, v
                    done += 1
                    break
            if done == 0:
                break
    for v in range(len(target)):
        while target[target[v]] != target[v]:
            target[v] = target[target[v]]


@step
def find_curves(mesh: Mesh, sides: NDArray[np.int8], curves: Ints) -> None:
    """Write the two neighbours of each vertex along the curve. Vertices of several curves stay."""
    for t in range(len(mesh.is_left)):
        for h in range(RECORD * t, RECORD * t + 3):
            u = mesh.edges[h]
            if sides[u] == 0 and _is_on_curve(h, mesh.edges, sides):
                if curves[u, 0] >= 0 and curves[u, 1] >= 0:
                    mesh.stays[u] = True
                curves[u, 1], curves[u, 0] = curves[u, 0], mesh.edges[ahead(h)]


@step
def find_on_curve(u: int, mesh: Mesh, ring: Ring, sides: NDArray[np.int8]) -> tuple[int, int]:
    """Write the ring of u; return the indices of its two neighbours on the curve, or (-1, -1)."""
    if not collect_fan(u, mesh, ring):
        return -1, -1
    count, first, second = 0, -1, -1
    for k in range(ring.sizes[TRIANGLES]):
        if _is_on_curve(ring.out[k], mesh.edges, sides):
            count += 1
            first, second = second, k
    return (first, second) if count == 2 else (-1, -1)
