"""A uniform grid of boxes that lists the triangles in each cell of space.

Cells are numbered along x first and z last, in the order in which surfaces of voxels (z, y, x) are
extracted. So successive cells hold successive triangles.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel
from stereocell.kernels.half_edges import Ints
from stereocell.kernels.triangles import Points


@kernel
def bound_boxes(at: Points, triangles: Ints) -> tuple[Points, Points]:
    """Return the least and the largest corner of each triangle's box, float64 (m, 3) each."""
    low, high = np.empty((len(triangles), 3)), np.empty((len(triangles), 3))
    for t in range(len(triangles)):
        for k in range(3):
            a, b, c = at[triangles[t, 0], k], at[triangles[t, 1], k], at[triangles[t, 2], k]
            low[t, k], high[t, k] = min(a, min(b, c)), max(a, max(b, c))
    return low, high


@kernel
def bound_all(low: Points, high: Points) -> tuple[Points, Points]:
    """Return the least and the largest corner of all boxes, float64 (3,) each."""
    least, most = np.full(3, np.inf), np.full(3, -np.inf)
    for t in range(len(low)):
        for k in range(3):
            least[k], most[k] = min(least[k], low[t, k]), max(most[k], high[t, k])
    return least, most


@kernel
def find_near(
    low: Points,
    high: Points,
    chosen: NDArray[np.bool_],
    origin: Points,
    edge: float,
    shape: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Return the boxes that touch a cell which a chosen box touches; see `list_by_cell`."""
    cells = np.zeros((shape[0], shape[1], shape[2]), np.bool_)
    near = chosen.copy()
    for is_reading in (False, True):
        for t in range(len(low)):
            if chosen[t] == is_reading:
                continue
            x0, x1 = int((low[t, 0] - origin[0]) / edge), int((high[t, 0] - origin[0]) / edge)
            y0, y1 = int((low[t, 1] - origin[1]) / edge), int((high[t, 1] - origin[1]) / edge)
            z0, z1 = int((low[t, 2] - origin[2]) / edge), int((high[t, 2] - origin[2]) / edge)
            for x in range(x0, x1 + 1):
                for y in range(y0, y1 + 1):
                    for z in range(z0, z1 + 1):
                        if is_reading:
                            near[t] |= cells[x, y, z]
                        else:
                            cells[x, y, z] = True
    return near


@kernel
def list_by_cell(
    low: Points, high: Points, origin: Points, edge: float, shape: NDArray[np.int64]
) -> tuple[Ints, Ints]:
    """Return the triangles, listed by the cells that their boxes touch.

    low, high  (m, 3), corners of the boxes
    origin     (3,), least corner of the grid
    edge       edge length of a cell
    shape      (3,), number of cells along each axis
    result     index of each cell's first entry, and the total (cells + 1,); triangles (entries,)
    """
    nx, ny, nz = shape
    first = np.zeros(nx * ny * nz + 1, np.int32)
    listed = np.empty(0, np.int32)
    for is_filling in (False, True):
        if is_filling:
            for c in range(len(first) - 1):
                first[c + 1] += first[c]
            listed = np.empty(first[-1], np.int32)
        place = first[:-1].copy() if is_filling else first
        for t in range(len(low)):
            x0, x1 = int((low[t, 0] - origin[0]) / edge), int((high[t, 0] - origin[0]) / edge)
            y0, y1 = int((low[t, 1] - origin[1]) / edge), int((high[t, 1] - origin[1]) / edge)
            z0, z1 = int((low[t, 2] - origin[2]) / edge), int((high[t, 2] - origin[2]) / edge)
            for z in range(z0, z1 + 1):
                for y in range(y0, y1 + 1):
                    for x in range(x0, x1 + 1):
                        c = (z * ny + y) * nx + x
                        if is_filling:
                            listed[place[c]] = t
                            place[c] += 1
                        else:
                            first[c + 1] += 1
    return first, listed


@kernel
def count_entries(low: Points, high: Points, origin: Points, edge: float) -> int:
    """Return the number of cells that the boxes touch, summed over boxes; see `list_by_cell`."""
    total = 0
    for t in range(len(low)):
        cells = 1
        for k in range(3):
            start, end = int((low[t, k] - origin[k]) / edge), int((high[t, k] - origin[k]) / edge)
            cells *= end - start + 1
        total += cells
    return total
