"""A uniform grid over the triangles of a mesh, with cells of a suitable size."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.grid import bound_all, bound_boxes, count_entries, find_near, list_by_cell

Points = NDArray[np.float64]
Ints = NDArray[np.int32]

EDGE = 1.5  # edge of a cell, as a multiple of the median side of the triangles
# Largest average number of cells per triangle; large triangles lie in many small cells
ENTRIES = 12
CELLS = 16  # largest number of cells per triangle; a mesh fills only a small part of its box
COARSE = 128  # cells along the longest side of a mesh, to find the triangles near others
MIN_CELLS, MAX_CELLS = 4096, 16_000_000  # bounds of the largest number of cells


@dataclass(frozen=True, slots=True)
class TriangleGrid:
    """Triangles listed by the cells of space that their boxes touch.

    low, high  float64 (m, 3), corners of the triangles' boxes
    first      int32, index of each cell's first entry in `listed`, and the total
    listed     int32, triangles
    origin     float64 (3,), least corner of the grid
    edge       edge length of a cell
    shape      int64 (3,), number of cells along each axis
    """

    low: Points
    high: Points
    first: Ints
    listed: Ints
    origin: Points
    edge: float
    shape: NDArray[np.int64]


def make_grid(positions: Points, triangles: Ints) -> TriangleGrid:
    """Return the grid of a mesh that has at least one triangle.

    positions  float64 (n, 3), contiguous
    triangles  int32 (m, 3), contiguous
    """
    low, high = bound_boxes(positions, triangles)
    origin, top = bound_all(low, high)
    extent = top - origin
    few = triangles[:: max(1, len(triangles) // 20_000)]
    sides = np.linalg.norm(positions[few[:, 0]] - positions[few[:, 1]], axis=1)
    edge = EDGE * float(np.median(sides))
    if edge <= 0:
        edge = float(extent.max()) or 1.0
    most = min(max(CELLS * len(triangles), MIN_CELLS), MAX_CELLS)
    while np.prod(np.floor(extent / edge) + 1) > most:
        edge *= 1.25
    while count_entries(low, high, origin, edge) > ENTRIES * len(triangles):
        edge *= 1.25
    shape = np.array([int(length / edge) + 1 for length in extent.tolist()], np.int64)
    first, listed = list_by_cell(low, high, origin, edge, shape)
    return TriangleGrid(low, high, first, listed, origin, edge, shape)


def find_around(positions: Points, triangles: Ints, chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return chosen triangles, and those whose boxes may meet theirs, int64 (k,).

    chosen  bool (m,); for other arguments see `make_grid`
    """
    low, high = bound_boxes(positions, triangles)
    origin, top = bound_all(low, high)
    edge = float((top - origin).max()) / COARSE or 1.0
    shape = ((top - origin) / edge).astype(np.int64) + 1
    return np.flatnonzero(find_near(low, high, chosen, origin, edge, shape))
