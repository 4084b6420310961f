"""The exact check that every mesh passes before it is written.

A valid mesh is closed except where another tile follows, without a wall there. Its edges and
vertices are 2-manifold, its triangles are wound consistently and outward, and it nowhere touches
itself. Topology is counted. Geometry is decided by the signs of determinants, without tolerances
(meshes/self_intersections.py). Only the winding of a whole body is the sign of a float64 sum, its
volume.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from stereocell.meshes.self_intersections import are_collinear, find_crossings
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Mesh

Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Defects:
    """The defects of a mesh; all arrays, int64, are empty for a valid one.

    degenerate             triangles (n,) with two equal corners, or all three on a line
    open                   edges (n, 2), by vertices, of one triangle only, that lie on no cut plane
    non_manifold_edges     edges (n, 2) of more than two triangles, or of two that are wound alike
    non_manifold_vertices  vertices (n,) whose triangles make more than one fan
    inside_out             one triangle (n,) of each body that is wound inwards
    crossings              pairs (n, 2) of triangles that meet beside their common corners
    walls                  triangles (n,) in a cut plane, where the neighbour may have one as well
    """

    degenerate: Indices
    open: Indices
    non_manifold_edges: Indices
    non_manifold_vertices: Indices
    inside_out: Indices
    crossings: Indices
    walls: Indices

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of defects of each kind."""
        return {field.name: len(getattr(self, field.name)) for field in fields(self)}

    @property
    def total(self) -> int:
        """Return the number of all defects."""
        return sum(self.counts.values())

    def vertices(self, triangles: NDArray[np.integer]) -> Indices:
        """Return the vertices of all defects, int64 (n,), sorted; triangles (m, 3): the mesh's."""
        whole = (self.degenerate, self.inside_out, self.walls, self.crossings.ravel())
        at = np.concatenate(whole)
        corners = triangles[at].astype(np.int64).ravel()
        parts = [
            corners,
            self.open.ravel(),
            self.non_manifold_edges.ravel(),
            self.non_manifold_vertices,
        ]
        return np.unique(np.concatenate(parts))


def find_defects(
    mesh: Mesh, planes: tuple[Plane, ...] = (), fresh: NDArray[np.bool_] | None = None
) -> Defects:
    """Return the mesh's defects; it may be open on the planes and nowhere else.

    mesh    positions float32 (n, 3), triangles uint32 (m, 3)
    planes  the cut planes: axis (0 x, 1 y, 2 z) and value in um
    fresh   bool (m,): crossings are looked for only in pairs with such a triangle; None: in all

    A body's winding is the sign of the volume that it encloses with the planes that cut it. A body
    of negative volume is a cavity, if it lies in the box of a solid.

    >>> corners = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> faces = np.uint32([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> find_defects(Mesh(corners, faces, corners)).total
    0
    >>> {k: n for k, n in find_defects(Mesh(corners, faces[:3], corners)).counts.items() if n}
    {'open': 3}
    """
    triangles = mesh.triangles.astype(np.int64)
    repeated = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    corners = mesh.positions.astype(np.float64)[triangles]
    degenerate = repeated | are_collinear(*corners.transpose(1, 0, 2))
    used = np.flatnonzero(~degenerate)
    edges, twins, is_non_manifold = match_edges(triangles)
    border_edges = np.flatnonzero((twins < 0) & ~is_non_manifold)
    lone = border_edges[~_on_planes(mesh.positions, edges[border_edges], planes)]
    non_manifold_vertices = find_non_manifold_vertices(triangles, twins, len(mesh.positions))
    one_fan = np.ones(len(mesh.positions), bool)
    one_fan[non_manifold_vertices] = False
    one_fan[edges[twins < 0]] = False
    one_fan[triangles[degenerate]] = False
    crossings = find_crossings(
        mesh.positions.astype(np.float64),
        triangles[used],
        one_fan=one_fan,
        fresh=None if fresh is None else fresh[used],
    )
    return Defects(
        degenerate=np.flatnonzero(degenerate),
        open=edges[lone],
        non_manifold_edges=np.unique(np.sort(edges[is_non_manifold], axis=1), axis=0),
        non_manifold_vertices=non_manifold_vertices,
        inside_out=_inside_out(mesh, corners, edges, border_edges, planes),
        crossings=used[crossings],
        walls=np.flatnonzero(_on_planes(mesh.positions, triangles, planes)),
    )


def label_components(triangles: NDArray[np.integer], vertices: int) -> NDArray[np.int32]:
    """Return the number of the connected body of each vertex, int32 (n,).

    triangles  (m, 3)
    vertices   number of vertices, n
    """
    a, b, c = triangles.astype(np.int64).T
    rows, columns = np.concatenate([a, b]), np.concatenate([b, c])
    edges = coo_matrix((np.ones(len(rows), bool), (rows, columns)), shape=(vertices, vertices))
    return connected_components(edges, directed=False)[1]


def border(triangles: NDArray[np.integer]) -> Indices:
    """Return the directed boundary edges, int64 (n, 2), sorted: they have no triangle beyond.

    triangles  (m, 3)
    """
    start = triangles.astype(np.int64)
    end = np.roll(start, -1, axis=1)
    # an edge and its twin differ in the last bit: sorted, they follow each other
    count = int(start.max(initial=0)) + 1
    key = (np.minimum(start, end) * count + np.maximum(start, end)) * 2 + (start > end)
    key = np.sort(key, axis=None)
    twin = key[:-1] ^ 1 == key[1:]
    edge, same = key // 2, np.zeros(len(key) + 1, bool)
    same[1:-1] = edge[:-1] == edge[1:]
    alone = np.ones(len(key), bool)
    pairs = np.flatnonzero(twin & ~same[:-2] & ~same[2:])
    alone[pairs] = alone[pairs + 1] = False
    low, high = np.divmod(edge[alone], count)
    turned = (key[alone] & 1).astype(bool)
    lone = np.stack([np.where(turned, high, low), np.where(turned, low, high)], axis=1)
    return lone[np.lexsort(lone.T[::-1])]


def match_edges(triangles: Indices) -> tuple[Indices, Indices, NDArray[np.bool_]]:
    """Return the directed edges int64 (3 m, 2), the twin of each or -1, and which are non-manifold.

    triangles  int64 (m, 3)

    Edge 3 t + k goes from corner k of triangle t to the next one.
    """
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    one, other = edges.T
    low, high = np.minimum(one, other), np.maximum(one, other)
    key = low * (high.max(initial=0) + 1) + high
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    sizes = np.diff(starts, append=len(order))
    twins = np.full(len(edges), -1, np.int64)
    two = starts[sizes == 2]
    first, second = order[two], order[two + 1]
    opposite = edges[first, 0] == edges[second, 1]
    opposite &= edges[first, 0] != edges[first, 1]
    twins[first[opposite]], twins[second[opposite]] = second[opposite], first[opposite]
    is_non_manifold = np.empty(len(edges), bool)
    is_non_manifold[order] = np.repeat(sizes >= 2, sizes)
    return edges, twins, is_non_manifold & (twins < 0)


def _on_planes(
    positions: NDArray[np.float32], corners: Indices, planes: tuple[Plane, ...]
) -> NDArray[np.bool_]:
    """Return which edges (n, 2) or triangles (n, 3) lie in one of the planes, bit by bit."""
    on = np.zeros(len(corners), bool)
    for column, value in planes:
        on |= (positions[corners, column] == np.float32(value)).all(axis=1)
    return on


def find_non_manifold_vertices(triangles: Indices, twins: Indices, vertices: int) -> Indices:
    """Return the vertices whose triangles don't make one fan, int64 (n,).

    triangles, twins  int64 (m, 3) and (3 m,), as of `match_edges`
    vertices          number of vertices

    It walks around each vertex and counts the triangles.
    """
    corners = triangles.ravel()
    valence = np.bincount(corners, minlength=vertices)
    index = np.arange(len(corners))
    # to the next triangle around the vertex, over the incoming edge: its twin starts at the vertex
    onward = twins[index - index % 3 + (index + 2) % 3]
    # a fan with a boundary is walked from its first triangle, whose outgoing edge has no twin
    begins = np.flatnonzero(twins < 0)
    start = np.full(vertices, -1, np.int64)
    start[corners] = index
    start[corners[begins]] = begins
    at = start[start >= 0]
    place = corners[at]
    first, count = at.copy(), np.ones(len(at), np.int64)
    active = np.arange(len(at))
    while len(active):
        step = onward[at[active]]
        goes = (step >= 0) & (step != first[active]) & (count[active] < valence[place[active]])
        active, step = active[goes], step[goes]
        at[active] = step
        count[active] += 1
    return place[count != valence[place]]


def _inside_out(
    mesh: Mesh,
    corners: NDArray[np.float64],
    edges: Indices,
    lone: Indices,
    planes: tuple[Plane, ...],
) -> Indices:
    """Return one triangle of each body that is wound inwards. `lone`: its boundary edges."""
    if not len(mesh.triangles):
        return np.zeros(0, np.int64)
    labels = label_components(mesh.triangles, len(mesh.positions))[mesh.triangles[:, 0]]
    names, first, body = np.unique(labels, return_index=True, return_inverse=True)
    a, b, c = corners.transpose(1, 0, 2)
    area = np.cross(b - a, c - a)
    # by its normals, for a body that reaches from plane to plane along all three axes
    size = np.bincount(body, (area * mesh.normals[mesh.triangles].sum(axis=1)).sum(axis=1))
    known = np.zeros(len(names), bool)
    for axis in range(3):
        # Gauss: the integral of x n_x. Caps across other axes add nothing, nor does one at x = 0
        zero, cuts = corners[first, 0, axis], np.zeros(len(names), int)
        for column, value in planes:
            if column == axis:
                on = lone[(mesh.positions[edges[lone], axis] == np.float32(value)).all(axis=1)]
                touched = np.unique(body[on // 3])
                zero[touched] = value
                cuts[touched] += 1
        height = corners[:, :, axis].sum(axis=1) - 3 * zero[body]
        volume = np.bincount(body, area[:, axis] * height)
        fits = (cuts <= 1) & ~known
        size[fits] = volume[fits]
        known |= fits
    wrong = size <= 0
    low, high = np.full((2, len(names), 3), np.inf) * [[[1.0]], [[-1.0]]]
    np.minimum.at(low, body, corners.min(axis=1))
    np.maximum.at(high, body, corners.max(axis=1))
    solid = ~wrong
    for hollow in np.flatnonzero(wrong & (size < 0)).tolist():
        around = (low[solid] <= low[hollow]).all(axis=1) & (high[solid] >= high[hollow]).all(axis=1)
        wrong[hollow] = not around.any()
    return first[wrong]
