"""A median in plane and a Gaussian, in one pass over the planes and in place.

The change of each value by both together can be limited.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.copying import copy_plane

Field = NDArray[np.float32]
Planes = NDArray[np.float32]
Row = NDArray[np.float32]
Weights = NDArray[np.float64]


@part
def _order_columns(above: Row, here: Row, below: Row, low: Row, mid: Row, high: Row) -> None:
    """Sort columns of three pixels into low, mid and high, from their second element on."""
    for x in range(len(here)):
        p, q, r = above[x], here[x], below[x]
        p, q = min(p, q), max(p, q)
        q, r = min(q, r), max(q, r)
        p, q = min(p, q), max(p, q)
        low[x + 1], mid[x + 1], high[x + 1] = p, q, r


@part
def _find_median(plane: Field, out: Field, low: Field, mid: Field, high: Field) -> None:
    """Write the median of the 3 x 3 pixels around each pixel; pixels at the edges are repeated.

    Columns of three are sorted first. The median of nine is then the median of three numbers: the
    largest of the low ones, the median of the middle ones, and the least of the high ones.

    References
    A. W. Paeth, "Median finding on a 3 x 3 grid", Graphics Gems, 1990, 171-175
    """
    height, width = plane.shape
    for y in range(height):
        above, here, below = plane[max(y - 1, 0)], plane[y], plane[min(y + 1, height - 1)]
        _order_columns(above, here, below, low, mid, high)
        low[0], mid[0], high[0] = low[1], mid[1], high[1]
        end = width + 1
        low[end], mid[end], high[end] = low[width], mid[width], high[width]
        row = out[y]
        for x in range(width):
            least = max(low[x], max(low[x + 1], low[x + 2]))
            most = min(high[x], min(high[x + 1], high[x + 2]))
            p, q, r = mid[x], mid[x + 1], mid[x + 2]
            q = max(min(p, q), min(max(p, q), r))
            row[x] = max(min(least, q), min(max(least, q), most))


@part
def _find_extremes(plane: Field, least: Field, most: Field, low: Row, high: Row) -> None:
    """Write the least and the largest of each pixel's eight neighbours.

    Beyond an edge the plane is mirrored. low, high: (width + 2,), working memory.
    """
    height, width = plane.shape
    for y in range(height):
        here = plane[y]
        above = plane[y - 1 if y else min(1, height - 1)]
        below = plane[y + 1 if y + 1 < height else max(y - 1, 0)]
        for x in range(width):
            low[x + 1] = min(here[x], min(above[x], below[x]))
            high[x + 1] = max(here[x], max(above[x], below[x]))
        near, far = min(2, width), max(width - 1, 1)
        low[0], high[0] = low[near], high[near]
        low[width + 1], high[width + 1] = low[far], high[far]
        lows, highs = least[y], most[y]
        for x in range(width):
            lows[x] = min(min(low[x], low[x + 2]), min(above[x], below[x]))
            highs[x] = max(max(high[x], high[x + 2]), max(above[x], below[x]))


@part
def _clip_hot_voxels(plane: Field, out: Field, least: Planes, most: Planes) -> None:
    """Write a plane in which each voxel is clipped to the range of its 24 neighbours.

    least, most  (3, height, width): extremes of planes z - 1, z and z + 1, in any order

    The two neighbours straight across the plane do not count, because a camera's hot pixel is hot
    in all planes.
    """
    height, width = plane.shape
    for y in range(height):
        here, row = plane[y], out[y]
        for x in range(width):
            floor = min(least[0, y, x], min(least[1, y, x], least[2, y, x]))
            ceiling = max(most[0, y, x], max(most[1, y, x], most[2, y, x]))
            row[x] = max(floor, min(ceiling, here[x]))


@part
def _add_pairs(total: Weights, weight: float, first: Row, second: Row) -> None:
    """Add to a row the sums of two other rows, times a weight."""
    for x in range(len(total)):
        total[x] += weight * (np.float64(first[x]) + np.float64(second[x]))


@part
def _add_two_pairs(
    total: Weights, weights: Weights, first: Row, second: Row, third: Row, fourth: Row
) -> None:
    """Call `_add_pairs` for two pairs of rows. One loop reads and writes the totals only once."""
    near, far = weights[0], weights[1]
    for x in range(len(total)):
        sums = total[x] + near * (np.float64(first[x]) + np.float64(second[x]))
        total[x] = sums + far * (np.float64(third[x]) + np.float64(fourth[x]))


@part
def _smooth_plane(
    plane: Field, out: Field, along_y: Weights, along_x: Weights, total: Weights, wide: Field
) -> None:
    """Write a plane smoothed along y and x; pixels at the edges are repeated.

    total  (width,), and wide (width + len(along_x) - 1,): working memory
    """
    height, width = plane.shape
    ry, rx = len(along_y) // 2, len(along_x) // 2
    for y in range(height):
        for x in range(width):
            total[x] = along_y[ry] * plane[y, x]
        for j in range(1, ry, 2):
            above, below = plane[max(y - j, 0)], plane[min(y + j, height - 1)]
            before, behind = plane[max(y - j - 1, 0)], plane[min(y + j + 1, height - 1)]
            _add_two_pairs(total, along_y[ry + j :], above, below, before, behind)
        if ry % 2:
            above, below = plane[max(y - ry, 0)], plane[min(y + ry, height - 1)]
            _add_pairs(total, along_y[2 * ry], above, below)
        for x in range(rx):
            wide[x] = total[0]
            wide[rx + width + x] = total[width - 1]
        for x in range(width):
            wide[rx + x] = total[x]
        for x in range(width):
            total[x] = along_x[rx] * wide[rx + x]
        for j in range(1, rx, 2):
            left, right, at = wide[rx - j :], wide[rx + j :], along_x[rx + j :]
            _add_two_pairs(total, at, left, right, wide[rx - j - 1 :], wide[rx + j + 1 :])
        if rx % 2:
            _add_pairs(total, along_x[2 * rx], wide, wide[2 * rx :])
        row = out[y]
        for x in range(width):
            row[x] = total[x]


@kernel
def smooth_in_place(
    field: Field,
    along_z: Weights,
    along_y: Weights,
    along_x: Weights,
    has_median: bool,
    max_shift: np.float32,
) -> None:
    """Smooth a field float32 (z, y, x) in place.

    along_z, along_y, along_x  weights, symmetric, of odd length, with a sum of 1
    has_median                 whether a 3 x 3 median in plane is applied first
    max_shift                  largest change of a value by both filters, from the voxel's value
                               after clipping hot voxels; infinite: no limit and no clipping

    Voxels at the edges are repeated. Sums are float64, in an order that depends only on the voxel's
    neighbours. The results along one axis are rounded to float32 before the next axis.
    """
    depth, height, width = field.shape
    rz, rx = len(along_z) // 2, len(along_x) // 2
    ring = np.empty((2 * rz + 1, height, width), np.float32)
    is_bounded = max_shift < np.inf
    measured = np.empty((rz + 1 if is_bounded else 0, height, width), np.float32)
    clips = is_bounded and has_median
    least = np.empty((3 if clips else 0, height, width), np.float32)
    most = np.empty((3 if clips else 0, height, width), np.float32)
    plane = np.empty((height, width), np.float32)
    low, mid = np.empty(width + 2, np.float32), np.empty(width + 2, np.float32)
    high = np.empty(width + 2, np.float32)
    total, wide = np.empty(width), np.empty(width + 2 * rx, np.float32)
    for z in range(depth + rz):
        if z < depth:
            if has_median:
                _find_median(field[z], plane, low, mid, high)
            else:
                copy_plane(field[z], plane)
            if clips:
                # Planes beyond the ends repeat those within, which changes no extreme.
                for k in range(0 if z == 0 else z + 1, min(z + 2, depth)):
                    _find_extremes(field[k], least[k % 3], most[k % 3], low, high)
                if z == 0:
                    copy_plane(least[0], least[2])
                    copy_plane(most[0], most[2])
                if z + 1 == depth:
                    copy_plane(least[z % 3], least[(z + 1) % 3])
                    copy_plane(most[z % 3], most[(z + 1) % 3])
                _clip_hot_voxels(field[z], measured[z % len(measured)], least, most)
            elif is_bounded:
                copy_plane(field[z], measured[z % len(measured)])
            _smooth_plane(plane, ring[z % len(ring)], along_y, along_x, total, wide)
        done = z - rz
        if done < 0:
            continue
        for y in range(height):
            middle = ring[done % len(ring), y]
            for x in range(width):
                total[x] = along_z[rz] * middle[x]
            for j in range(1, rz, 2):
                above = ring[max(done - j, 0) % len(ring), y]
                below = ring[min(done + j, depth - 1) % len(ring), y]
                before = ring[max(done - j - 1, 0) % len(ring), y]
                behind = ring[min(done + j + 1, depth - 1) % len(ring), y]
                _add_two_pairs(total, along_z[rz + j :], above, below, before, behind)
            if rz % 2:
                above = ring[max(done - rz, 0) % len(ring), y]
                below = ring[min(done + rz, depth - 1) % len(ring), y]
                _add_pairs(total, along_z[2 * rz], above, below)
            row = field[done, y]
            for x in range(width):
                row[x] = total[x]
            if is_bounded:
                own = measured[done % len(measured), y]
                for x in range(width):
                    row[x] = max(own[x] - max_shift, min(own[x] + max_shift, row[x]))
