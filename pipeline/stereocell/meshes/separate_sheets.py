"""Separate a surface where simplification has drawn two of its sheets together.

Simplification may collapse the ring of edges around a neck, or inside a tunnel. It leaves edges of
four triangles, and vertices with two fans. Here the surface is cut in such places, as if the neck
had been cut or the tunnel filled, at the cost of a vertex. The alternative, to lock all vertices
around them, kept 1.4 times as many triangles on walls full of small tunnels.

The result may still have defects: sheets may meet, and some non-manifold places stay.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from stereocell.meshes.validity import find_non_manifold_vertices, match_edges
from stereocell.model.mesh import Mesh

APART = 0.2  # share of the way to its neighbours by which a fan's vertex is moved off the other fan
TINY = 1e-30  # least length that is divided by

Indices = NDArray[np.int64]
Triangles = NDArray[np.uint32]


def separate_sheets(mesh: Mesh, triangles: Triangles) -> tuple[Mesh, Triangles, Indices]:
    """Return the mesh with new vertices at its end, the separated triangles, the vertices' sources.

    triangles  uint32 (m, 3), by the mesh's vertices; they may differ from the mesh's own
    result     a mesh with its own triangles; the separated ones, uint32 (m, 3); int64 (k,), for
               each new vertex the number of the vertex that it was split from

    Vertices on boundary edges stay.
    """
    corners = triangles.astype(np.int64)
    edges, twins, is_non_manifold = match_edges(corners)
    quads = _find_quads(mesh.positions, edges, is_non_manifold)
    _pair(twins, quads)
    suspect = np.zeros(len(mesh.positions), bool)
    suspect[edges[is_non_manifold]] = True
    suspect[find_non_manifold_vertices(corners, twins, len(mesh.positions))] = True
    suspect[edges[twins < 0]] = False
    at = np.flatnonzero(suspect[corners].ravel())
    if not len(at):
        return mesh, triangles, at
    fan = _label_fans(at, twins)
    # both pairs can have the same fans at both ends: then they still share one edge
    one, other = quads[:, 0], quads[:, 2]
    stuck = (fan[one] == fan[other]) & (fan[_onward(one)] == fan[_onward(other)])
    if stuck.any():
        _pair(twins, np.roll(quads[stuck], -1, axis=1))
        fan = _label_fans(at, twins)
    return _draw_apart(mesh, corners, at, fan[at])


def _onward(corner: Indices) -> Indices:
    """Return the corner after this one in its triangle, or the edge after this one."""
    return corner - corner % 3 + (corner + 1) % 3


def _find_quads(
    positions: NDArray[np.float32], edges: Indices, is_non_manifold: NDArray[np.bool_]
) -> Indices:
    """Return non-manifold edges that coincide, four (n, 4) at a time, wound in turns.

    They come in their order around the edge, so that no sheets cross if neighbours are paired. The
    first is chosen so that the wider of the two wedges is as narrow as possible: two sheets that
    are bent away from each other.
    """
    at = np.flatnonzero(is_non_manifold)
    low, high = edges[at].min(axis=1), edges[at].max(axis=1)
    order = np.lexsort((high, low))
    at, low, high = at[order], low[order], high[order]
    starts = np.flatnonzero((np.diff(low, prepend=-1) != 0) | (np.diff(high, prepend=-1) != 0))
    starts = starts[np.diff(starts, append=len(at)) == 4]
    quads = at[starts[:, None] + np.arange(4)]
    angle = _angles(positions, low[starts], high[starts], edges[_onward(_onward(quads)), 0])
    order = np.argsort(angle, axis=1, kind="stable")
    angle, quads = (np.take_along_axis(part, order, axis=1) for part in (angle, quads))
    rises = edges[quads, 0] == low[starts, None]
    turns = (rises[:, 0] != rises[:, 1]) & (rises[:, :2] == rises[:, 2:]).all(axis=1)
    wedge = np.diff(angle, append=angle[:, :1] + 2 * np.pi)
    later = wedge[:, [0, 2]].max(axis=1) > wedge[:, [1, 3]].max(axis=1)
    return np.where(later[:, None], np.roll(quads, -1, axis=1), quads)[turns]


def _angles(
    positions: NDArray[np.float32], start: Indices, end: Indices, seen: Indices
) -> NDArray[np.float64]:
    """Return the angles (n, 4) of vertices (n, 4) around edges, from the first on, in radians."""
    origin = positions[start].astype(np.float64)
    axis = positions[end] - origin
    axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), TINY)
    away = positions[seen] - origin[:, None]
    side = away - (away * axis[:, None]).sum(axis=2, keepdims=True) * axis[:, None]
    across = np.cross(axis, side[:, 0])
    return np.arctan2((side * across[:, None]).sum(axis=2), (side * side[:, :1]).sum(axis=2))


def _pair(twins: Indices, quads: Indices) -> None:
    """Make twins of the first two of each four edges, and of the last two."""
    one, other = quads.reshape(-1, 2).T
    twins[one], twins[other] = other, one


def _label_fans(at: Indices, twins: Indices) -> Indices:
    """Return the number of the fan for each corner in `at`, and -1 for all others."""
    fan = np.full(len(twins), -1, np.int64)
    fan[at] = np.arange(len(at))
    next_round = fan[_onward(twins[at])]  # over the edge that leaves the corner
    links = coo_matrix((np.ones(len(at), bool), (fan[at], next_round)), (len(at), len(at)))
    fan[at] = connected_components(links, directed=False)[1]
    return fan


def _draw_apart(
    mesh: Mesh, corners: Indices, at: Indices, fan: Indices
) -> tuple[Mesh, Triangles, Indices]:
    """Give each fan of a vertex with several fans its own one; results as `separate_sheets`."""
    vertex = corners.ravel()[at]
    source = np.zeros(fan.max() + 1, np.int64)
    source[fan] = vertex
    split = (np.bincount(source, minlength=len(mesh.positions)) > 1)[source]
    number = np.where(split, len(mesh.positions) + np.cumsum(split) - 1, source)
    where = mesh.positions[corners].astype(np.float64)
    flat = where.reshape(-1, 3)
    mean = _sums(flat[_onward(at)] - flat[at], fan) / np.bincount(fan)[:, None]
    area = np.cross(where[:, 1] - where[:, 0], where[:, 2] - where[:, 0])
    normal = _sums(area[at // 3], fan)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), TINY)
    done = corners.ravel()
    done[at] = number[fan]
    source = source[split]
    positions = (mesh.positions[source] + APART * mean[split]).astype(np.float32)
    larger = Mesh(
        np.concatenate([mesh.positions, positions]),
        mesh.triangles,
        np.concatenate([mesh.normals, normal[split].astype(np.float32)]),
    )
    return larger, done.reshape(-1, 3).astype(np.uint32), source


def _sums(vectors: NDArray[np.float64], group: Indices) -> NDArray[np.float64]:
    """Return the sum of vectors (n, 3) in each group."""
    return np.stack([np.bincount(group, vectors[:, axis]) for axis in range(3)], axis=1)
