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

from stereocell.kernels.half_edges import CROWDED, count_fans, label_bodies, match_twins
from stereocell.meshes.self_intersections import find_crossings, find_flat
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
    positions = mesh.positions.astype(np.float64)
    degenerate = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    degenerate[find_flat(positions, triangles)] = True
    used = np.flatnonzero(~degenerate)
    edges, twins, is_non_manifold = match_edges(triangles)
    border_edges = np.flatnonzero((twins < 0) & ~is_non_manifold)
    lone = border_edges[~_on_planes(mesh.positions, edges[border_edges], planes)]
    non_manifold_vertices = find_non_manifold_vertices(triangles, twins, len(mesh.positions))
    crossings = find_crossings(
        positions, triangles[used], fresh=None if fresh is None else fresh[used]
    )
    return Defects(
        degenerate=np.flatnonzero(degenerate),
        open=edges[lone],
        non_manifold_edges=np.unique(np.sort(edges[is_non_manifold], axis=1), axis=0),
        non_manifold_vertices=non_manifold_vertices,
        inside_out=_inside_out(mesh, positions[triangles], edges, border_edges, planes),
        crossings=used[crossings],
        walls=np.flatnonzero(_on_planes(mesh.positions, triangles, planes)),
    )


def label_components(triangles: NDArray[np.integer], vertices: int) -> NDArray[np.int32]:
    """Return the number of the connected body of each vertex, int32 (n,).

    triangles  (m, 3)
    vertices   number of vertices, n
    """
    return label_bodies(np.ascontiguousarray(triangles, np.int32), vertices)[0]


def border(triangles: NDArray[np.integer]) -> Indices:
    """Return the directed boundary edges, int64 (n, 2), sorted: they have no triangle beyond.

    triangles  (m, 3)
    """
    edges, twins, _ = match_edges(triangles.astype(np.int64))
    lone = edges[twins < 0]
    return lone[np.lexsort(lone.T[::-1])]


def match_edges(triangles: Indices) -> tuple[Indices, Indices, NDArray[np.bool_]]:
    """Return the directed edges int64 (3 m, 2), the twin of each or -1, and which are non-manifold.

    triangles  int64 (m, 3)

    Edge 3 t + k goes from corner k of triangle t to the next one.
    """
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    count = int(triangles.max(initial=-1)) + 1
    twins = match_twins(np.ascontiguousarray(triangles, np.int32), count)
    return edges, twins.astype(np.int64), twins == CROWDED


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
    corners, across = (np.ascontiguousarray(a, np.int32) for a in (triangles, twins))
    return np.flatnonzero(count_fans(corners, across, vertices)[1] < 0)


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
