"""Arrays for collapses: a mesh that is changed in place, and the ring of one vertex."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.edge_records import RECORD
from stereocell.kernels.half_edges import Ints
from stereocell.kernels.triangles import Points

Flags = NDArray[np.bool_]

MAX_NEIGHBOURS = 512  # largest number of neighbours of a surface's vertex that may move
MAX_TRIANGLES = 96  # largest number of triangles of a vertex of interfaces that may move
CACHE_LINE = 64  # bytes
TRIANGLES, NEIGHBOURS, STAMP = 0, 1, 2  # indices into Ring.sizes


class Mesh(NamedTuple):
    """A surface or a set of interfaces, with n vertices and m triangles."""

    # float64 (n, 4), um: position, and the largest distance from it of vertices merged into it
    at: Points
    quadrics: Points  # float64 (n, 12): kernels/quadrics.py
    edges: Ints  # int32 (8 m,): kernels/edge_records.py
    start: Ints  # int32 (n,), a half-edge that leaves each vertex, or -1
    is_left: Flags  # bool (m,), triangles that no collapse has removed
    stays: Flags  # bool (n,), vertices that no collapse moves
    on_line: Flags  # bool (n,), vertices on lines of interfaces; (0,) for a surface
    planes: NDArray[np.uint8]  # uint8 (n,), a bit for each cut plane that a vertex lies in
    caps: NDArray[np.uint8]  # uint8 (n,), a bit for each cap; a vertex moves only within its caps
    errors: Points  # float64 (n,), largest allowed root mean square of distances from the planes


class Ring(NamedTuple):
    """The triangles around a vertex, and its neighbours; the arrays fit the largest ring."""

    out: Ints  # the half-edge of each triangle that leaves the vertex
    first: Ints  # the corner after the vertex, of each triangle
    second: Ints  # the corner before the vertex, of each triangle
    near: Ints  # neighbours; in a surface, this is `first`
    shared: Ints  # interfaces: number of triangles at the edge to each neighbour
    price: Points  # price of moving onto each neighbour
    marks: Ints  # interfaces: marks of neighbours
    # Interfaces: int32 (n,), index among the neighbours, of vertices with the last stamp
    slot: Ints
    stamp: Ints  # int32 (n,), the last ring that each vertex was a neighbour in
    sizes: Ints  # int32 (3,): number of triangles, number of neighbours, last stamp


def make_ring(n: int, *, is_surface: bool) -> Ring:
    """Return empty arrays for the ring of one vertex, in a mesh of n vertices."""
    most = MAX_NEIGHBOURS if is_surface else MAX_TRIANGLES
    first, room = np.empty(most, np.int32), 0 if is_surface else 2 * most
    return Ring(
        out=np.empty(most, np.int32),
        first=first,
        second=np.empty(most, np.int32),
        near=first if is_surface else np.empty(room, np.int32),
        shared=np.empty(room, np.int32),
        price=np.empty(max(most, room)),
        marks=np.empty(room, np.int32),
        slot=np.zeros(0 if is_surface else n, np.int32),
        stamp=np.zeros(n, np.int32),
        sizes=np.zeros(3, np.int32),
    )


def make_mesh(
    n: int,
    m: int,
    *,
    on_line: Flags | None = None,
    planes: NDArray[np.uint8] | None = None,
    caps: NDArray[np.uint8] | None = None,
    errors: Points | None = None,
) -> Mesh:
    """Return a mesh of n vertices and m triangles without positions and edges.

    numpy allocates the arrays, because it asks for large pages.
    """
    return Mesh(
        at=_zeros(4 * n, np.float64).reshape(n, 4),
        quadrics=_zeros(12 * n, np.float64).reshape(n, 12),
        edges=_zeros(RECORD * m, np.int32),
        start=np.empty(n, np.int32),
        is_left=np.ones(m, bool),
        stays=np.zeros(n, bool),
        on_line=np.zeros(0, bool) if on_line is None else on_line,
        planes=np.zeros(n, np.uint8) if planes is None else planes,
        caps=np.zeros(n, np.uint8) if caps is None else caps,
        errors=np.zeros(n) if errors is None else errors,
    )


def _zeros(size: int, kind: type[np.float64 | np.int32]) -> NDArray[Any]:
    """Return zeros that start at the start of a cache line."""
    numbers = CACHE_LINE // np.dtype(kind).itemsize
    room = np.zeros(size + numbers, kind)
    start = -room.ctypes.data % CACHE_LINE // room.itemsize
    return room[start : start + size]
