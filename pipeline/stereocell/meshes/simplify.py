"""Simplify a mesh within an absolute error; boundary edges and topology stay.

Vertices move onto their neighbours (kernels/collapse.py). The vertices that are left have not
moved, and keep their normals and values. Vertices of boundary edges stay. So the edges on a common
plane are the same at every level, and neighbours at different levels still meet. A body keeps its
handles and is never split, and never gets thinner than the errors allow. But bodies may cross each
other afterwards: see meshes/simplify_valid.py.

The error of a small body is bounded by its size: at an error of half its radius a ball is a few
spikes.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.collapse import collapse
from stereocell.kernels.flips import flip_edges
from stereocell.kernels.half_edges import label_vertices, measure_boxes, renumber_corners
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Mesh

# Largest error that a body may have, as a share of its box's diagonal, and of its shortest side
OF_DIAGONAL, OF_SIDE = 0.1, 0.2
STRAY = 3.0  # largest distance of a vertex from the result, as a multiple of its largest error
# Degrees; smallest allowed angle of a triangle, unless triangles around it are sharper already
SHARPEST_DEG = 12.0
FLIP_DEG = 25.0  # degrees; edges of triangles with a smaller angle are flipped

Moves = NDArray[np.int32]  # (n, 2), collapses: a vertex, and the one onto which it moved
NOTHING: Moves = np.zeros((0, 2), np.int32)


def simplify(mesh: Mesh, max_error_um: float, *, planes: tuple[Plane, ...] = ()) -> Mesh:
    """Return the mesh with as few triangles as the error allows; boundary vertices stay.

    mesh          positions float32 (n, 3) in um, triangles uint32 (m, 3)
    max_error_um  largest root of the mean squared distance of a vertex from the planes of the
                  triangles that it represents; less on small bodies, see `find_errors`
    planes        the cut planes, where the mesh may be open; no triangle comes to lie in one

    >>> v = np.array([[i % 5, i // 5, 0] for i in range(25)], np.float32)
    >>> a = np.array([i for i in range(20) if i % 5 < 4], np.uint32)
    >>> t = np.concatenate([np.stack([a, a + 1, a + 6], 1), np.stack([a, a + 6, a + 5], 1)])
    >>> flat = Mesh(v, t, np.tile(np.float32([0, 0, 1]), (25, 1)))
    >>> len(flat.triangles), len(simplify(flat, 0.01).triangles)
    (32, 16)
    """
    locked = np.zeros(len(mesh.positions), bool)
    bodies = label_vertices(np.ascontiguousarray(mesh.triangles, np.int32), len(mesh.positions))
    errors = find_errors(mesh, max_error_um, bodies)
    corners, left, _ = simplify_part(
        mesh, mesh.triangles, errors, locked=locked, planes=planes, past=NOTHING
    )
    return compact(mesh, corners[left])


def find_errors(
    mesh: Mesh, max_error_um: float, bodies: tuple[NDArray[np.int32], int]
) -> NDArray[np.float64]:
    """Return the error that each vertex may have (n,), um; it is less on small bodies.

    bodies  body of each vertex, int32 (n,), and the number of bodies: see `label_vertices`
    """
    labels, count = bodies
    sides = measure_boxes(mesh.positions.astype(np.float64), labels, count)
    own = np.minimum(OF_DIAGONAL * np.linalg.norm(sides, axis=1), OF_SIDE * sides.min(axis=1))
    return np.minimum(max_error_um, own[labels])


def simplify_part(
    mesh: Mesh,
    triangles: NDArray[np.uint32],
    errors: NDArray[np.float64],
    *,
    locked: NDArray[np.bool_],
    planes: tuple[Plane, ...],
    caps: tuple[Plane, ...] = (),
    past: Moves,
) -> tuple[NDArray[np.uint32], NDArray[np.bool_], Moves]:
    """Simplify the triangles of some whole bodies.

    triangles  uint32 (m, 3), by the mesh's vertices
    errors     float64 (n,), see `find_errors`
    locked     bool (n,), vertices that stay
    planes     the cut planes
    caps       planes of caps, which stay flat
    past       earlier moves of these bodies, with fewer locked vertices; they are repeated except
               around the newly locked ones
    result     triangles uint32 (m, 3), a mask (m,) of those that are left, and the moves
    """
    used, own = renumber(triangles, len(mesh.positions))
    if not len(used):
        return triangles, np.zeros(0, bool), NOTHING
    positions = mesh.positions.take(used, axis=0)
    bits, of_caps = (find_planes(positions, some) for some in (planes, caps))
    at = positions.astype(np.float64)
    del positions
    at -= (at.min(axis=0) + at.max(axis=0)) / 2
    sharpest, sharp = np.cos(np.radians([SHARPEST_DEG, FLIP_DEG])).tolist()
    number = np.zeros(len(mesh.positions), np.int32)
    number[used] = np.arange(len(used), dtype=np.int32)
    corners, left, moves = collapse(
        at,
        own.view(np.int32),
        locked[used],
        bits,
        errors[used],
        STRAY,
        sharpest,
        number[past],
        of_caps,
    )
    kept = corners[left]
    flip_edges(at, kept, locked[used], bits, of_caps, errors[used], sharp)
    corners[left] = kept
    return used.astype(np.uint32).take(corners), left, used.astype(np.int32)[moves]


def find_planes(positions: NDArray[np.float32], planes: tuple[Plane, ...]) -> NDArray[np.uint8]:
    """Return a bit for each plane that a vertex lies in, uint8 (n,), exactly.

    positions  float32 (n, 3), (x, y, z), um
    """
    bits = np.zeros(len(positions), np.uint8)
    for bit, (column, value) in enumerate(planes):
        bits |= (positions[:, column] == np.float32(value)).astype(np.uint8) << bit
    return bits


def renumber(
    triangles: NDArray[np.uint32], vertices: int
) -> tuple[NDArray[np.int64], NDArray[np.uint32]]:
    """Return the used vertices in order, int64 (k,), and the triangles by indices among them.

    triangles  uint32 (m, 3)
    vertices   number of vertices
    """
    return renumber_corners(np.ascontiguousarray(triangles, np.uint32), vertices)


def compact(mesh: Mesh, triangles: NDArray[np.uint32]) -> Mesh:
    """Return the mesh of some triangles (m, 3), with only their vertices, in the same order."""
    used, own = renumber(triangles, len(mesh.positions))
    return Mesh(mesh.positions[used], own, mesh.normals[used])
