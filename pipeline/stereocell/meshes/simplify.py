"""Simplify a mesh within an absolute error; boundary edges stay.

Simplification is meshoptimizer's (quadric errors, Garland & Heckbert), bounded by an error in um.
It only removes vertices, so normals stay valid. Boundary edges are locked: the edges on a common
plane are the same at every level, and neighbours at different levels still meet.

References
M. Garland & P. S. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
doi:10.1145/258734.258849
"""

import ctypes

import meshoptimizer
import numpy as np
from meshoptimizer._loader import lib
from numpy.typing import NDArray

from stereocell.meshes.validity import label_components
from stereocell.model.mesh import Mesh

# meshoptimizer 0.2.30a0 declares no argument types for the only call that takes locked vertices;
# without them ctypes passes a float as an int
lib.meshopt_simplifyWithAttributes.argtypes = [
    ctypes.POINTER(ctypes.c_uint),  # destination
    ctypes.POINTER(ctypes.c_uint),  # indices
    ctypes.c_size_t,
    ctypes.POINTER(ctypes.c_float),  # positions
    ctypes.c_size_t,  # how many
    ctypes.c_size_t,  # stride
    ctypes.POINTER(ctypes.c_float),  # attributes
    ctypes.c_size_t,  # stride
    ctypes.POINTER(ctypes.c_float),  # their weights
    ctypes.c_size_t,  # how many
    ctypes.POINTER(ctypes.c_ubyte),  # locked
    ctypes.c_size_t,  # indices wanted
    ctypes.c_float,  # error allowed
    ctypes.c_uint,  # options
    ctypes.POINTER(ctypes.c_float),  # error found
]
lib.meshopt_simplifyWithAttributes.restype = ctypes.c_size_t


FEWEST = 8  # triangles left of a body that would vanish: an octahedron


def simplify(mesh: Mesh, max_error_um: float) -> Mesh:
    """Return the mesh with as few triangles as the error allows; boundary vertices stay.

    mesh          positions float32 (n, 3) in um, triangles uint32 (m, 3)
    max_error_um  largest quadric error

    >>> v = np.array([[i % 5, i // 5, 0] for i in range(25)], np.float32)
    >>> a = np.array([i for i in range(20) if i % 5 < 4], np.uint32)
    >>> t = np.concatenate([np.stack([a, a + 1, a + 6], 1), np.stack([a, a + 6, a + 5], 1)])
    >>> flat = Mesh(v, t, np.tile(np.float32([0, 0, 1]), (25, 1)))
    >>> len(flat.triangles), len(simplify(flat, 0.01).triangles)
    (32, 14)
    """
    locked = np.zeros(len(mesh.positions), bool)
    return compact(
        mesh, simplify_part(mesh, mesh.triangles, max_error_um=max_error_um, locked=locked)
    )


def simplify_part(
    mesh: Mesh,
    triangles: NDArray[np.uint32],
    *,
    max_error_um: float,
    locked: NDArray[np.bool_],
) -> NDArray[np.uint32]:
    """Return fewer triangles in place of those of some whole bodies, uint32 (k, 3).

    triangles     uint32 (m, 3), by the mesh's vertices
    max_error_um  largest quadric error
    locked        bool (n,), vertices that stay

    The simplifier's error is a mean over planes: at a bound near a body's radius the whole body
    vanishes, or becomes flat. Such a body is simplified by itself, down to FEWEST triangles.
    """
    kept = drop_doubles(_simplify(mesh.positions, triangles, max_error_um, 0, locked))
    numbers = label_components(triangles, len(mesh.positions))
    body = numbers[triangles[:, 0]]
    vanished = np.flatnonzero(~np.isin(body, numbers[kept[:, 0]]))
    vanished = vanished[np.argsort(body[vanished], kind="stable")]
    ends = np.flatnonzero(np.diff(body[vanished])) + 1
    small = [
        _shrink(mesh, triangles[part], max_error_um, locked)
        for part in np.split(vanished, ends)
        if len(part)
    ]
    return np.concatenate([kept, *small])


def _shrink(
    mesh: Mesh,
    triangles: NDArray[np.uint32],
    max_error_um: float,
    locked: NDArray[np.bool_],
) -> NDArray[np.uint32]:
    """Return FEWEST triangles, or as many as the error needs, in place of those of one body."""
    shrunk = drop_doubles(_simplify(mesh.positions, triangles, max_error_um, FEWEST, locked))
    return shrunk if len(shrunk) else triangles


def _simplify(
    positions: NDArray[np.float32],
    triangles: NDArray[np.uint32],
    max_error_um: float,
    fewest: int,
    locked: NDArray[np.bool_],
) -> NDArray[np.uint32]:
    # used vertices only: the simplifier's time grows with all vertices that it gets
    used, own = renumber(triangles, len(positions))
    source = own.ravel()
    result = np.empty_like(source)
    count = meshoptimizer.simplify_with_attributes(
        result,
        source,
        np.ascontiguousarray(positions[used]),
        vertex_attributes=np.zeros((len(used), 1), np.float32),
        attribute_weights=np.zeros(0, np.float32),
        vertex_lock=locked[used],
        target_index_count=3 * fewest,
        target_error=max_error_um,
        options=meshoptimizer.SIMPLIFY_LOCK_BORDER | meshoptimizer.SIMPLIFY_ERROR_ABSOLUTE,
    )
    return used[result[:count]].astype(np.uint32).reshape(-1, 3)


def renumber(
    triangles: NDArray[np.uint32], vertices: int
) -> tuple[NDArray[np.int64], NDArray[np.uint32]]:
    """Return the used vertices, int64 (k,), in order, and the triangles by their places there.

    triangles  uint32 (m, 3)
    vertices   number of vertices
    """
    used = np.zeros(vertices, bool)
    used[triangles.ravel()] = True
    place = (np.cumsum(used) - 1).astype(np.uint32)
    return np.flatnonzero(used), place[triangles]


def drop_doubles(triangles: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return the triangles without collapsed and repeated ones, in the same order, uint32 (k, 3).

    Two triangles of the same corners, wound in opposite directions, are a sheet without thickness:
    both go. Each edge loses one triangle in either direction, so that a closed mesh stays closed,
    and boundary edges stay where they are. Of triangles wound alike the first stays.
    """
    a, b, c = np.sort(triangles, axis=1).T
    order = np.lexsort((c, b, a))
    a, b, c = a[order], b[order], c[order]
    new = np.ones(len(order), bool)
    new[1:] = (a[1:] != a[:-1]) | (b[1:] != b[:-1]) | (c[1:] != c[:-1])
    collapsed = (a == b) | (b == c)
    if new.all() and not collapsed.any():
        return triangles
    first, middle, last = triangles[order].T
    rising = (first < middle).astype(int) + (middle < last) + (last < first)
    winding = np.where(rising == 2, 1, -1)  # a cyclic turn of (a, b, c), or of (c, b, a)
    group = np.cumsum(new) - 1
    balance = np.bincount(group, winding)[group]
    stays = (winding * balance > 0) & ~collapsed
    # the first of its group with the winding of most
    _, firsts = np.unique(group[stays], return_index=True)
    return triangles[np.sort(order[stays][firsts])]


def compact(mesh: Mesh, triangles: NDArray[np.uint32]) -> Mesh:
    """Return the mesh of these triangles (m, 3), with their vertices only, in the same order."""
    used, own = renumber(triangles, len(mesh.positions))
    return Mesh(mesh.positions[used], own, mesh.normals[used])
