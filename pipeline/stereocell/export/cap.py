"""Close a surface at the faces of tiles whose neighbour is missing: hidden, or moved away.

All open edges lie in the planes between tiles. In each plane, they bound the cross-sections of the
solid: polygons with holes, which are filled with triangles.

At the line where two of these planes meet, polygons of both planes end in the same points. Both
ends of the line are outside the solid. So the line is inside the solid between the first and the
second point, between the third and the fourth, and so on.
"""

from collections.abc import Sequence
from typing import Any

import manifold3d
import numpy as np
from numpy.typing import NDArray

from stereocell.meshes.validity import border

Plane = tuple[int, float]  # axis of the plane's normal (0: x), and the plane's coordinate
_NEAR = 1e-4  # largest distance of a vertex from its plane, as a share of the box's longest edge


def close_cuts(
    positions: NDArray[np.float64], triangles: NDArray[np.uint32], planes: Sequence[Plane]
) -> NDArray[np.uint32]:
    """Add triangles that close the openings of a surface in some planes.

    positions  float64 (n, 3), in a space where the tiles' faces are perpendicular to the axes

    Returns all triangles, uint32 (m, 3). An opening whose edges form no loops stays open.
    """
    edges = border(triangles)
    if not len(edges):
        return triangles
    near = _NEAR * float(np.ptp(positions, axis=0).max())
    opposite = _third_corners(triangles, edges)
    caps: list[NDArray[np.integer[Any]]] = [triangles]
    for axis, value in planes:
        is_in = (np.abs(positions[edges][..., axis] - value) < near).all(axis=1)
        for side in (-1, 1):  # side of the plane on which the solid is
            away = positions[opposite, axis] - value
            rows = is_in & (np.sign(away) == side)
            if rows.any():
                caps.append(_cap(positions, edges[rows][:, ::-1], axis, side))
    return np.concatenate(caps).astype(np.uint32)


def _third_corners(triangles: NDArray[np.uint32], edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return, for each directed edge, the corner opposite to it in its triangle."""
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
    """Return triangles that fill the loops of directed edges in a plane; empty without loops."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    if side > 0:  # the normal of the cap points in the axis's negative direction
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
    """Return edges that join the ends of open chains, along the lines where two planes meet."""
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
    """Return closed chains of directed edges. Edges that are in no closed chain are left out."""
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
