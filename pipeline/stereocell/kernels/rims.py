"""Thin out the vertices that a surface has on a plane, where another plane cuts it.

The surface is one on both sides of the plane, and a vertex of the plane moves onto its neighbour
along the curve in which the plane cuts the surface: each side by itself is as sound as the whole.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.collapse import MAX_NEIGHBOURS, VALENCE, keeps_form
from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.edge_records import (
    RECORD,
    TWIN,
    ahead,
    behind,
    count_common,
    fill_records,
    join,
)
from stereocell.kernels.half_edges import Ints, count_fans, find_fixed, match_twins
from stereocell.kernels.triangles import Points, doubled_area, smallest_angle_cosine

STEPS = 4  # steps in which the error grows up to its bound: flat parts go first
PASSES = 6  # passes over one step
SHARPER = 0.1  # square of the least share of the sharpest angle: 1 - cos goes with the square


@part
def _way_to(at: Points, u: int, p: int, n: int) -> float:
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
    """Return the largest distance from the segment pq of u, and of those that went beside it.

    curves   int32 (n, 2), the two neighbours that each vertex had along the curve
    leaving  negative where a vertex has gone
    """
    most = _way_to(at, u, p, q)
    for k in range(2):
        past, here = u, curves[u, k]
        while leaving[here] < 0:
            most = max(most, _way_to(at, here, p, q))
            onward = curves[here, 0] if curves[here, 1] == past else curves[here, 1]
            past, here = here, onward
    return most


@kernel
def thin_rim(
    at: Points,
    triangles: Ints,
    sides: NDArray[np.int8],
    planes: NDArray[np.uint8],
    locked: NDArray[np.bool_],
    error: float,
    sharpest: float,
) -> Ints:
    """Return the vertex onto which each vertex moves, int32 (n,); most stay.

    at         float64 (n, 3)
    triangles  int32 (m, 3); vertices of borders stay
    sides      int8 (n,): -1 or 1 beside the plane, 0 in it
    planes     uint8 (n,), a bit for each cut plane that a vertex lies in, this one and others
    locked     bool (n,), vertices that stay
    error      largest distance of a vertex from the curve that is left
    sharpest   cosine of the smallest angle that a triangle may get, unless those around are sharper
    """
    n = len(at)
    twins = match_twins(triangles, n)
    leaving, valence = count_fans(triangles, twins, n)
    stays = find_fixed(locked, triangles.ravel(), twins, valence)
    edges = np.empty(RECORD * len(triangles), np.int32)
    fill_records(triangles, twins, leaving, edges)
    for v in range(n):
        stays[v] |= sides[v] != 0
    curves = np.full((n, 2), -1, np.int32)
    for t in range(len(triangles)):
        for h in range(RECORD * t, RECORD * t + 3):
            u = edges[h]
            if sides[u] == 0 and _is_on_curve(h, edges, sides):
                if curves[u, 0] >= 0 and curves[u, 1] >= 0:
                    stays[u] = True  # several curves meet
                curves[u, 1], curves[u, 0] = curves[u, 0], edges[ahead(h)]
    target = np.arange(n).astype(np.int32)
    touched, turn = np.zeros(n, np.int32), 0
    stamp, tick = np.zeros(n, np.int32), 0
    ring, out = np.empty(MAX_NEIGHBOURS, np.int32), np.empty(MAX_NEIGHBOURS, np.int32)
    onward = np.empty(MAX_NEIGHBOURS, np.int32)
    for step in range(1, STEPS + 1):
        bound = error * step / STEPS
        for _ in range(PASSES):
            turn, done = turn + 1, 0
            for u in range(n):
                if stays[u] or leaving[u] < 0 or touched[u] == turn:
                    continue
                size, h, worst, curve = 0, leaving[u], 0.0, 0
                bx, by, bz = 0.0, 0.0, 0.0
                first, second = -1, -1  # half-edges along the curve
                while size < MAX_NEIGHBOURS:
                    v, last = edges[ahead(h)], edges[behind(h)]
                    ring[size], onward[size], out[size] = v, last, h
                    worst = max(worst, smallest_angle_cosine(at, u, v, last))
                    x, y, z = doubled_area(at, u, v, last)
                    bx, by, bz = bx + x, by + y, bz + z
                    if _is_on_curve(h, edges, sides):
                        curve += 1
                        first, second = h, first
                    size += 1
                    h = edges[behind(h) + TWIN]
                    if h == leaving[u]:
                        break
                if h != leaving[u] or curve != 2:
                    continue
                p, q = edges[ahead(first)], edges[ahead(second)]
                if _farthest(at, u, p, q, curves, leaving) > bound:
                    continue
                allowed = max(sharpest, 1 - SHARPER * (1 - worst))
                tick += 1
                for j in range(size):
                    stamp[ring[j]] = tick
                for h in (first, second):
                    v = edges[ahead(h)]
                    common, others = count_common(h, edges, stamp, tick)
                    if common != 2 or not 7 <= others + size <= VALENCE:
                        continue
                    if not keeps_form(at, u, v, ring, onward, size, (bx, by, bz), allowed, planes):
                        continue
                    touched[p] = touched[q] = turn
                    join(h, v, out, size, edges, leaving)
                    leaving[u], target[u] = -1, v
                    done += 1
                    break
            if done == 0:
                break
    for v in range(n):
        while target[target[v]] != target[v]:
            target[v] = target[target[v]]
    return target
