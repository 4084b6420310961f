"""Nearest points of a mesh, by a uniform grid of its triangles."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.half_edges import Ints
from stereocell.kernels.triangles import Points, Triple, closest, doubled_area


@kernel
def find_nearest(
    points: Points,
    at: Points,
    triangles: Ints,
    first: Ints,
    listed: Ints,
    origin: Points,
    edge: float,
    shape: NDArray[np.int64],
    seen: Ints,
    tick: int,
) -> tuple[Points, NDArray[np.int64], NDArray[np.int8]]:
    """Return the distance of each point (n,), the nearest triangle, and its part (see `closest`).

    points               (n, 3)
    first, listed        triangles by cell, see kernels/grid.py
    origin, edge, shape  of the grid, which holds all triangles
    seen                 int32 (m,), for each triangle the number of the last point that examined it
    tick                 number of the first point, larger than all in `seen`. Triangles that are
                         left out have numbers that no point reaches.

    Cells are searched in shells around the point, until no triangle beyond can be nearer. The
    first of several triangles at the same distance is returned.
    """
    distance, nearest = np.empty(len(points)), np.empty(len(points), np.int64)
    parts = np.empty(len(points), np.int8)
    centre, inside = np.empty(3, np.int64), np.empty(3)
    nx, ny, nz = shape
    largest = max(nx, max(ny, nz))
    for i in range(len(points)):
        beyond = 0.0  # squared distance of the point from the grid
        for k in range(3):
            inside[k] = min(max(points[i, k], origin[k]), origin[k] + shape[k] * edge)
            beyond += (points[i, k] - inside[k]) ** 2
            centre[k] = min(int((inside[k] - origin[k]) / edge), shape[k] - 1)
        best, triangle, where = np.inf, -1, 0
        for reach in range(largest + 1):
            for x in range(max(centre[0] - reach, 0), min(centre[0] + reach, shape[0] - 1) + 1):
                on_side = abs(x - centre[0]) == reach
                for y in range(max(centre[1] - reach, 0), min(centre[1] + reach, ny - 1) + 1):
                    whole = on_side or abs(y - centre[1]) == reach
                    step = 1 if whole or reach == 0 else 2 * reach
                    for z in range(centre[2] - reach, centre[2] + reach + 1, step):
                        if not 0 <= z < nz:
                            continue
                        cell = (z * ny + y) * nx + x
                        for place in range(first[cell], first[cell + 1]):
                            t = listed[place]
                            if seen[t] >= tick + i:
                                continue
                            seen[t] = tick + i
                            square, side = closest(
                                points[i, 0], points[i, 1], points[i, 2],
                                at, triangles[t, 0], triangles[t, 1], triangles[t, 2],
                            )  # fmt: skip
                            if square < best:
                                best, triangle, where = square, t, side
            # Distance from the grid's nearest point to the cells that are not searched yet
            margin = np.inf
            for k in range(3):
                start = origin[k] + (centre[k] - reach) * edge
                margin = min(margin, inside[k] - start)
                margin = min(margin, start + (2 * reach + 1) * edge - inside[k])
            if best <= beyond + max(margin, 0.0) ** 2:
                break
        distance[i], nearest[i], parts[i] = np.sqrt(best), triangle, where
    return distance, nearest, parts


@part
def _unit_normal(at: Points, triangles: Ints, t: int) -> Triple:
    """Return the unit normal of a triangle; 0 if it has no area."""
    x, y, z = doubled_area(at, triangles[t, 0], triangles[t, 1], triangles[t, 2])
    length = max(np.sqrt(x * x + y * y + z * z), 1e-300)
    return x / length, y / length, z / length


@part
def _angle_at(at: Points, here: int, one: int, other: int) -> float:
    x, y, z = doubled_area(at, here, one, other)
    along = 0.0
    for k in range(3):
        along += (at[one, k] - at[here, k]) * (at[other, k] - at[here, k])
    return np.arctan2(np.sqrt(x * x + y * y + z * z), along)


@kernel
def find_sides(
    points: Points,
    nearest: NDArray[np.int64],
    parts: NDArray[np.int8],
    at: Points,
    triangles: Ints,
    twins: Ints,
) -> NDArray[np.bool_]:
    """Return which points lie inside, bool (n,), by the pseudonormal at their nearest points.

    points          (n, 3)
    nearest, parts  of `find_nearest`
    at, triangles   a closed mesh, with its `twins` from `match_twins`

    References
    J. A. Baerentzen & H. Aanaes, "Signed distance computation using the angle weighted
    pseudonormal", IEEE TVCG 11(3), 2005. doi:10.1109/TVCG.2005.49
    """
    is_asked = np.zeros(len(at), np.bool_)
    for i in range(len(points)):
        if parts[i] < 3:
            is_asked[triangles[nearest[i], parts[i]]] = True
    around = np.zeros((len(at), 3))
    for t in range(len(triangles)):
        for k in range(3):
            v = triangles[t, k]
            if is_asked[v]:
                x, y, z = _unit_normal(at, triangles, t)
                angle = _angle_at(at, v, triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3])
                around[v, 0] += angle * x
                around[v, 1] += angle * y
                around[v, 2] += angle * z
    inside = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        t, side = nearest[i], parts[i]
        x, y, z = _unit_normal(at, triangles, t)
        if side < 3:
            x, y, z = around[triangles[t, side]]
        elif side < 6:
            twin = twins[3 * t + side - 3]
            if twin >= 0:
                dx, dy, dz = _unit_normal(at, triangles, twin // 3)
                x, y, z = x + dx, y + dy, z + dz
        ahead = points[i] - at[triangles[t, side % 3]]
        inside[i] = ahead[0] * x + ahead[1] * y + ahead[2] * z < 0
    return inside
