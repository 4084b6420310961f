"""The exact check that every mesh passes before it is written.

A valid mesh is closed, except on cut planes where another tile follows, and has no triangle in such
a plane. Its edges and vertices are 2-manifold, its triangles are wound consistently and outward,
and it touches itself nowhere. Topology is counted. Geometry is decided by the signs of
determinants, without tolerances (meshes/self_intersections.py). Only the winding of a whole body is
the sign of a float64 sum, its volume.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.half_edges import (
    BORDER,
    CROWDED,
    count_fans,
    find_first,
    label_vertices,
    lie_within,
    match_twins,
    measure_windings,
)
from stereocell.kernels.triangle_rows import repeat_a_corner, share_a_plane
from stereocell.meshes.self_intersections import find_crossings, find_flat
from stereocell.meshes.simplify import find_planes
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Mesh

Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Defects:
    """The defects of a mesh. All arrays are int64, and empty for a valid mesh.

    degenerate             triangles (n,) with two equal corners, or with all three on a line
    open                   edges (n, 2), by vertices, of only one triangle, that lie on no cut plane
    non_manifold_edges     edges (n, 2) of more than two triangles, or of two that are wound alike
    non_manifold_vertices  vertices (n,) whose triangles form more than one fan
    inside_out             one triangle (n,) of each body that is wound inwards
    crossings              pairs (n, 2) of triangles that meet away from their common corners
    in_cut_plane           triangles (n,) in a cut plane, where the neighbour may have one as well
    """

    degenerate: Indices
    open: Indices
    non_manifold_edges: Indices
    non_manifold_vertices: Indices
    inside_out: Indices
    crossings: Indices
    in_cut_plane: Indices

    @property
    def counts(self) -> dict[str, int]:
        """The number of defects of each kind."""
        return {field.name: len(getattr(self, field.name)) for field in fields(self)}

    @property
    def total(self) -> int:
        """The number of all defects."""
        return sum(self.counts.values())

    def vertices(self, triangles: NDArray[np.integer]) -> Indices:
        """Return the vertices of all defects, int64 (n,), sorted. triangles: the mesh's (m, 3)."""
        whole = (self.degenerate, self.inside_out, self.in_cut_plane, self.crossings.ravel())
        at = np.concatenate(whole)
        corners = triangles[at].astype(np.int64).ravel()
        parts = [
            corners,
            self.open.ravel(),
            self.non_manifold_edges.ravel(),
            self.non_manifold_vertices,
        ]
        return np.unique(np.concatenate(parts))


@dataclass(frozen=True, slots=True)
class Topology:
    """The parts of the check that do not depend on positions, from `find_topology`.

    corners                int32 (m, 3), the triangles
    twins                  int32 (3 m,), see `match_twins`
    rim, crowded           directed edges (n, 2) with no other triangle, and with several others
    non_manifold_vertices  (n,)
    bodies                 body of each vertex, and the number of bodies
    """

    corners: NDArray[np.int32]
    twins: NDArray[np.int32]
    rim: Indices
    crowded: Indices
    non_manifold_vertices: Indices
    bodies: tuple[NDArray[np.int32], int]


def find_topology(triangles: NDArray[np.integer], vertices: int) -> Topology:
    """Return how triangles (m, 3) are connected. vertices: their number."""
    # The indices of a large mesh take much memory, and a view of them none.
    is_view = triangles.dtype == np.uint32
    corners = triangles.view(np.int32) if is_view else triangles.astype(np.int32)
    corners = np.ascontiguousarray(corners)
    twins = match_twins(corners, vertices)
    return Topology(
        corners,
        twins,
        _ends_of(corners, np.flatnonzero(twins == BORDER)),
        _ends_of(corners, np.flatnonzero(twins == CROWDED)),
        np.flatnonzero(count_fans(corners, twins, vertices)[1] < 0),
        label_vertices(corners, vertices),
    )


def find_defects(
    mesh: Mesh,
    *,
    planes: tuple[Plane, ...] = (),
    fresh: NDArray[np.bool_] | None = None,
    topology: Topology | None = None,
) -> Defects:
    """Return the defects of a mesh, which may be open only on the planes.

    mesh      positions float32 (n, 3), triangles uint32 (m, 3)
    planes    the cut planes: axis (0 x, 1 y, 2 z) and value in um
    fresh     bool (m,); only pairs with such a triangle are checked for crossings; None: all pairs
    topology  topology of the triangles, known from a mesh with other positions; None: not known

    A body's winding is the sign of the volume that it encloses together with the planes that cut
    it. A body of negative volume is a cavity if it lies in the box of a solid.

    >>> corners = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> faces = np.uint32([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> find_defects(Mesh(corners, faces, corners)).total
    0
    >>> {k: n for k, n in find_defects(Mesh(corners, faces[:3], corners)).counts.items() if n}
    {'open': 3}
    """
    topology = topology or find_topology(mesh.triangles, len(mesh.positions))
    triangles, rim = topology.corners, topology.rim
    positions = mesh.positions.astype(np.float64)
    degenerate = repeat_a_corner(triangles)
    degenerate[find_flat(positions, triangles)] = True
    used = np.flatnonzero(~degenerate)
    if len(used) < len(triangles):
        triangles, fresh = triangles[used], None if fresh is None else fresh[used]
    crossings = find_crossings(positions, triangles, fresh=fresh)
    on_planes = find_planes(mesh.positions, planes)
    return Defects(
        degenerate=np.flatnonzero(degenerate),
        open=rim[(on_planes[rim[:, 0]] & on_planes[rim[:, 1]]) == 0],
        non_manifold_edges=np.unique(np.sort(topology.crowded, axis=1), axis=0),
        non_manifold_vertices=topology.non_manifold_vertices,
        inside_out=_inside_out(mesh, topology, planes),
        crossings=used[crossings],
        in_cut_plane=np.flatnonzero(share_a_plane(on_planes, topology.corners)),
    )


def label_components(triangles: NDArray[np.integer], vertices: int) -> NDArray[np.int32]:
    """Return the index of the body (connected component) of each vertex, int32 (n,).

    triangles  (m, 3)
    vertices   number of vertices, n
    """
    return label_vertices(np.ascontiguousarray(triangles, np.int32), vertices)[0]


def border(triangles: NDArray[np.integer]) -> Indices:
    """Return the directed boundary edges, int64 (n, 2), sorted: they have only one triangle.

    triangles  (m, 3)
    """
    corners = np.ascontiguousarray(triangles, np.int32)
    twins = match_twins(corners, int(corners.max(initial=-1)) + 1)
    lone = _ends_of(corners, np.flatnonzero(twins < 0))
    return lone[np.lexsort(lone.T[::-1])]


def _ends_of(triangles: NDArray[np.int32], half_edges: NDArray[np.integer]) -> Indices:
    """Return the two vertices of half-edges, int64 (n, 2)."""
    triangle, corner = np.divmod(half_edges, 3)
    ends = triangles[triangle, corner], triangles[triangle, (corner + 1) % 3]
    return np.stack(ends, axis=1).astype(np.int64)


@dataclass(frozen=True, slots=True)
class Sizes:
    """The volumes that bodies enclose with the planes that cut them, from `measure_sizes`.

    volumes    (b,), um^3, negative for a cavity; if unknown, any number with the right sign
    are_known  bool (b,); False for a body that reaches from plane to plane along all three axes
    low, high  (b, 3), corners of each body's box
    first      int64 (b,), a triangle of each body, or -1 if it has none
    faces_out  bool (b,); True for a body that is open on a plane and whose triangles face the same
               way as the normals of its vertices
    """

    volumes: NDArray[np.float64]
    are_known: NDArray[np.bool_]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    first: Indices
    faces_out: NDArray[np.bool_]


def measure_sizes(mesh: Mesh, planes: tuple[Plane, ...], topology: Topology) -> Sizes:
    """Return the volumes of a mesh's bodies. It has triangles, and may be open on the planes."""
    triangles, rim, (labels, bodies) = topology.corners, topology.rim, topology.bodies
    positions = mesh.positions.astype(np.float64)
    first = find_first(triangles, labels, bodies).astype(np.int64)
    zero, cuts = positions[triangles[first, 0]], np.zeros((bodies, 3), int)
    for column, value in planes:
        on = (mesh.positions[rim, column] == np.float32(value)).all(axis=1)
        touched = np.unique(labels[rim[on, 0]])
        zero[touched, column] = value
        cuts[touched, column] += 1
    along, volumes, low, high = measure_windings(
        positions, np.ascontiguousarray(mesh.normals, np.float32), triangles, labels, zero
    )
    size, known = along.copy(), np.zeros(bodies, bool)
    for axis in range(3):
        # By Gauss's law, the integral of x n_x. Caps across other axes add nothing, and neither
        # does a cap at x = 0.
        fits = (cuts[:, axis] <= 1) & ~known
        size[fits] = volumes[fits, axis] / 6  # the sums have doubled areas and three heights each
        known |= fits
    return Sizes(size, known, low, high, first, (cuts > 0).any(axis=1) & (along > 0))


def _inside_out(mesh: Mesh, topology: Topology, planes: tuple[Plane, ...]) -> Indices:
    """Return one triangle of each body that is wound inwards."""
    if not len(topology.corners):
        return np.zeros(0, np.int64)
    found = measure_sizes(mesh, planes, topology)
    size, low, high, first = found.volumes, found.low, found.high, found.first
    wrong, solid = (first >= 0) & (size <= 0), (first >= 0) & (size > 0)
    hollow = np.flatnonzero(wrong & (size < 0))
    # A solid that fills a tile up to all its planes has no surface around the cavities in it.
    is_held = lie_within(low, high, hollow, np.flatnonzero(solid)) | found.faces_out[hollow]
    wrong[hollow] = ~is_held
    return first[wrong]
