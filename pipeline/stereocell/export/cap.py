"""Close a surface where tiles were cut and the neighbour is not there: hidden, or moved away.

All open edges lie in the planes between tiles. In each plane they bound the places where the solid
went on: polygons, with holes, that are filled. Where two such planes meet, a polygon of each ends
at the line that both have in common, at the same points; the solid crosses the line between the
first and the second, the third and the fourth, and so on, since it ends before the specimen does.
"""

from collections.abc import Sequence
from typing import Any

import manifold3d
import numpy as np
from numpy.typing import NDArray

from stereocell.meshes.validity import border

Plane = tuple[int, float]  # the axis that it is across, and where
_NEAR = 1e-4  # share of the surface's size within which a vertex is in a plane


def close_cuts(
    positions: NDArray[np.float64], triangles: NDArray[np.uint32], planes: Sequence[Plane]
) -> NDArray[np.uint32]:
    """Return the triangles and those that close the openings; some stay open where it can't be.

    positions  float64 (n, 3), in the space in which tiles are cut along the axes
    """
    edges = border(triangles)
    if not len(edges):
        return triangles
    near = _NEAR * float(np.ptp(positions, axis=0).max())
    opposite = _third_corners(triangles, edges)
    caps: list[NDArray[np.integer[Any]]] = [triangles]
    for axis, value in planes:
        is_in = (np.abs(positions[edges][..., axis] - value) < near).all(axis=1)
        for side in (-1, 1):  # of the plane, on which the solid is
            away = positions[opposite, axis] - value
            rows = is_in & (np.sign(away) == side)
            if rows.any():
                caps.append(_cap(positions, edges[rows][:, ::-1], axis, side))
    return np.concatenate(caps).astype(np.uint32)


def _third_corners(triangles: NDArray[np.uint32], edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the corner of each directed edge's triangle that is not on the edge."""
    wide = triangles.astype(np.int64)
    all_edges = np.concatenate([wide[:, [0, 1]], wide[:, [1, 2]], wide[:, [2, 0]]])
    third = np.concatenate([wide[:, 2], wide[:, 0], wide[:, 1]])
    count = int(wide.max()) + 1
    keys = all_edges[:, 0] * count + all_edges[:, 1]
    order = np.argsort(keys)
    return third[order[np.searchsorted(keys[order], edges[:, 0] * count + edges[:, 1])]]


def _cap(
    positions: NDArray[np.float64], edges: NDArray[np.int64], axis: int, side: int
) -> NDArray[np.int64]:
    """Return triangles that fill what directed edges bound in a plane; none where they don't."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    if side > 0:  # the cap faces down the axis
        first, second = second, first
    flat = positions[:, [first, second]]
    edges = np.concatenate([edges, _along_lines(flat, edges)])
    loops = _loops(edges)
    if not loops:
        return np.zeros((0, 3), np.int64)
    numbers = np.concatenate(loops)
    filled = manifold3d.triangulate([np.ascontiguousarray(flat[loop]) for loop in loops])
    return numbers[np.asarray(filled, np.int64)]


def _along_lines(flat: NDArray[np.float64], edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the edges that join the ends of open chains along the lines on which they lie."""
    starts, ends = edges[:, 0], edges[:, 1]
    heads, tails = np.setdiff1d(ends, starts), np.setdiff1d(starts, ends)
    loose = np.concatenate([heads, tails])
    is_head = np.repeat([True, False], [len(heads), len(tails)])
    found = []
    size = float(np.ptp(flat, axis=0).max())
    for across in (0, 1):
        places = flat[loose, across]
        for value in np.unique(np.round(places / (_NEAR * size))).tolist():
            on_line = np.abs(places - value * _NEAR * size) < 2 * _NEAR * size
            rows = np.flatnonzero(on_line)
            rows = rows[np.argsort(flat[loose[rows], 1 - across], kind="stable")]
            if len(rows) % 2:
                continue
            for a, b in rows.reshape(-1, 2).tolist():
                if is_head[a] != is_head[b]:
                    head, tail = (a, b) if is_head[a] else (b, a)
                    found.append((loose[head], loose[tail]))
    unique = sorted(set(found))
    return np.array(unique, np.int64).reshape(-1, 2)


def _loops(edges: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return closed chains of directed edges; what is no part of one is left out."""
    following: dict[int, list[int]] = {}
    for start, end in edges.tolist():
        following.setdefault(start, []).append(end)
    loops = []
    for start in list(following):
        while following.get(start):
            chain = [start]
            while (ways := following.get(chain[-1])) and (len(chain) == 1 or chain[-1] != start):
                chain.append(ways.pop())
            if chain[-1] == start and len(chain) > 3:
                loops.append(np.array(chain[:-1], np.int64))
    return loops
