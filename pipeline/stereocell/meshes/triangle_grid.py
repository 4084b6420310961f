"""A uniform grid over a mesh's triangles, whose cells fit them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.grid import bound_all, bound_boxes, count_entries, find_near, list_by_cell

Points = NDArray[np.float64]
Ints = NDArray[np.int32]

EDGE = 1.5  # edge of a cell, in lengths of the median side of a triangle
ENTRIES = 12  # cells that a triangle may lie in, on average: large ones among small ask for more
CELLS = 16  # a triangle, at most: a mesh fills little of its box
COARSE = 128  # cells along the longest side of a mesh, to see which triangles are near others
MIN_CELLS, MAX_CELLS = 4096, 16_000_000  # cells, at most


@dataclass(frozen=True, slots=True)
class TriangleGrid:
    """Triangles by the cells of space that their boxes touch.

    low, high  float64 (m, 3), corners of the triangles' boxes
    first      int32, place of each cell's first entry in `listed`, and one more
    listed     int32, triangles
    origin     float64 (3,), least corner of the grid
    edge       of a cell
    shape      int64 (3,), cells
    """

    low: Points
    high: Points
    first: Ints
    listed: Ints
    origin: Points
    edge: float
    shape: NDArray[np.int64]


def make_grid(positions: Points, triangles: Ints) -> TriangleGrid:
    """Return the grid of a mesh of one triangle or more.

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
    """Return the triangles whose boxes may meet those of chosen ones, and these, int64 (k,).

    chosen  bool (m,); other arguments as of `make_grid`
    """
    low, high = bound_boxes(positions, triangles)
    origin, top = bound_all(low, high)
    edge = float((top - origin).max()) / COARSE or 1.0
    shape = ((top - origin) / edge).astype(np.int64) + 1
    return np.flatnonzero(find_near(low, high, chosen, origin, edge, shape))
