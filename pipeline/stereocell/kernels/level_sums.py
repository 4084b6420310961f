"""Sums over voxels by their value, in one pass; a channel's levels are found on them."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.gradients import Field, Row, square_slopes

Flags = NDArray[np.bool_]
Planes = NDArray[np.float64]
Box = NDArray[np.int64]  # first and end (3, 2) of the voxels in a window that are counted
_Index = np.uint64


@kernel
def sum_by_value(
    field: Field,
    padding: Flags,
    own: Box,
    steps: Row,
    table: NDArray[np.int16],
    low: np.float32,
    step: np.float32,
    span: np.float32,
    bins: int,
) -> Row:
    """Return sums in bins (2, bins, 3), over the voxels outside of padding and over padding.

    field, padding  (z, y, x), a window around the voxels that are counted
    steps           spacing (z, y, x)
    table           bin of values from low + k * step on; a value beyond an end counts as that end
    low, step       least value of the table, and the difference between its values
    span            unit of the slopes in the third sum

    The three sums are the number of voxels, their slopes, and their squared slopes in units of
    span.
    """
    depth, _, width = field.shape
    ends, factors = 1 / steps, 0.5 / steps
    sums, squares = np.zeros(2 * bins * 3), np.empty(width)
    places, slopes = np.empty(width, np.int32), np.empty(width, np.float32)
    most = np.float32(len(table) - 1)
    for z in range(own[0, 0], own[0, 1]):
        before, behind = field[max(z - 1, 0)], field[min(z + 1, depth - 1)]
        factors[0] = 0.5 * ends[0] if 0 < z < depth - 1 else ends[0]
        for y in range(own[1, 0], own[1, 1]):
            square_slopes(before, field[z], behind, y, factors, ends, squares)
            row, is_out = field[z, y], padding[z, y]
            for x in range(width):
                place = (row[x] - low) / step
                # NaN becomes 0, too: the indices below are not checked
                places[x] = np.int32(min(place if place > 0 else np.float32(0), most))
            for x in range(width):
                slopes[x] = np.sqrt(squares[x])
            for x in range(own[2, 0], own[2, 1]):
                # Indices without a sign need no check whether they count from the end.
                group = _Index(is_out[x]) * _Index(bins) + _Index(table[_Index(places[x])])
                at, share = group * _Index(3), slopes[x] / span
                sums[at] += 1
                sums[at + _Index(1)] += np.float64(slopes[x])
                sums[at + _Index(2)] += np.float64(share * share)
    return sums.reshape(2, bins, 3)


@kernel
def count_differences(
    field: Field, padding: Flags, own: Box, lag: int, first: NDArray[np.int16], edges: Row
) -> Box:
    """Return a histogram of the differences between voxels `lag` apart along x.

    first  first bin of the float32 numbers that have the same upper 16 bits, which lie in this bin
           and the next one
    edges  ends of the bins, rising; larger differences count in the last bin
    """
    counts, last = np.zeros(len(edges) - 1, np.int64), np.int64(len(edges) - 2)
    width = max(min(own[2, 1], field.shape[2] - lag) - own[2, 0], 0)
    sizes = np.empty(width, np.float32)
    bits = sizes.view(np.uint32)
    for z in range(own[0, 0], own[0, 1]):
        for y in range(own[1, 0], own[1, 1]):
            here, there = field[z, y, own[2, 0] :], field[z, y, own[2, 0] + lag :]
            out, beyond = padding[z, y, own[2, 0] :], padding[z, y, own[2, 0] + lag :]
            for x in range(width):
                sizes[x] = abs(there[x] - here[x])
            for x in range(width):  # no branch, because half of them would be guessed wrong
                b = np.int64(first[_Index(bits[x] >> 16)])
                b = min(b + np.int64(edges[_Index(b + 1)] <= sizes[x]), last)
                counts[_Index(b)] += np.int64(not (out[x] or beyond[x]))
    return counts


@kernel
def sum_along_axes(field: Field, padding: Flags, own: Box) -> tuple[Row, Row, Row, Box, Box, Box]:
    """Return the sums of the voxels outside of padding in each plane, row and column.

    The first three arrays are sums by z, y and x, and the others are the numbers of voxels.
    """
    z0, y0, x0 = own[:, 0]
    depth, height, width = own[:, 1] - own[:, 0]
    by_z, by_y, by_x = np.zeros(depth), np.zeros(height), np.zeros(width)
    in_z, in_y = np.zeros(depth, np.int64), np.zeros(height, np.int64)
    in_x, values = np.zeros(width, np.int64), np.empty(width)
    for z in range(depth):
        for y in range(height):
            row, out = field[z0 + z, y0 + y, x0:], padding[z0 + z, y0 + y, x0:]
            count = 0
            for x in range(width):
                is_in = not out[x]
                values[x] = np.float64(row[x]) if is_in else 0.0
                by_x[x] += values[x]
                in_x[x] += is_in
                count += is_in
            total = _sum_row(values)
            by_z[z] += total
            by_y[y] += total
            in_z[z] += count
            in_y[y] += count
    return by_z, by_y, by_x, in_z, in_y, in_x


@part
def _sum_row(values: Row) -> float:
    """Return the sum of a row: four sums of every fourth value, which need not wait in turn."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    whole = len(values) - len(values) % 4
    for x in range(0, whole, 4):
        a += values[x]
        b += values[x + 1]
        c += values[x + 2]
        d += values[x + 3]
    for x in range(whole, len(values)):
        a += values[x]
    return (a + b) + (c + d)


@kernel
def sum_neighbours(plane: Planes, padding: Flags, own: Box, scale: Row, sums: Planes) -> None:
    """Add sums over a plane's voxels and over neighbours, as values less the scale's middle.

    plane    float64 (y, x), a window around the voxels that are counted
    padding  bool, the same window; voxels that are left out
    own      first and end (2, 2) of the voxels that are counted
    scale    least, middle and largest value; values beyond the ends are clipped
    sums     (7, columns that are counted), by column: count, sum, sum of squares, then count and
             sum of products of neighbours from row to row, and the same from column to column
    """
    width = plane.shape[1]
    x0, x1 = own[1]
    here, there = np.empty(width), np.empty(width)
    is_in, are_in = np.empty(width, np.int64), np.empty(width, np.int64)
    _place_row(plane, padding, own[0, 0], scale, here, is_in)
    for y in range(own[0, 0], own[0, 1]):
        _place_row(plane, padding, y + 1, scale, there, are_in)
        for x in range(x1 - x0):
            value, count = here[x0 + x], is_in[x0 + x]
            sums[0, x] += count
            sums[1, x] += value
            sums[2, x] += value * value
            sums[3, x] += count * are_in[x0 + x]
            sums[4, x] += value * there[x0 + x]
        for x in range(min(x1, width - 1) - x0):
            sums[5, x] += is_in[x0 + x] * is_in[x0 + x + 1]
            sums[6, x] += here[x0 + x] * here[x0 + x + 1]
        here, there = there, here
        is_in, are_in = are_in, is_in


@part
def _place_row(
    plane: Planes, padding: Flags, y: int, scale: Row, values: Row, is_in: NDArray[np.int64]
) -> None:
    """Write a row's values less the middle, and 1 for each; 0 and 0 for padding and past the end.

    scale  least, middle and largest value
    """
    height, width = plane.shape
    low, middle, high = scale
    row, out = plane[min(y, height - 1)], padding[min(y, height - 1)]
    for x in range(width):
        is_in[x] = y < height and not out[x]
        values[x] = min(max(row[x], low), high) - middle if is_in[x] else 0.0
