"""Sums over voxels by their value, in one pass; a channel's levels are found on them."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel
from stereocell.kernels.gradients import Field, Row, square_slopes

Flags = NDArray[np.bool_]
Box = NDArray[np.int64]  # first and end (3, 2) of the voxels in a window that are counted


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
    sums, squares = np.zeros((2, bins, 3)), np.empty(width)
    most = np.float32(len(table) - 1)
    for z in range(own[0, 0], own[0, 1]):
        before, behind = field[max(z - 1, 0)], field[min(z + 1, depth - 1)]
        factors[0] = 0.5 * ends[0] if 0 < z < depth - 1 else ends[0]
        for y in range(own[1, 0], own[1, 1]):
            square_slopes(before, field[z], behind, y, factors, ends, squares)
            row, is_out = field[z, y], padding[z, y]
            for x in range(own[2, 0], own[2, 1]):
                place = min(max((row[x] - low) / step, np.float32(0)), most)
                into = sums[int(is_out[x]), table[np.int64(place)]]
                slope = np.float32(np.sqrt(squares[x]))
                share = slope / span
                into[0] += 1
                into[1] += np.float64(slope)
                into[2] += np.float64(share * share)
    return sums


@kernel
def count_differences(
    field: Field, padding: Flags, own: Box, lag: int, first: NDArray[np.int16], edges: Row
) -> Box:
    """Return a histogram of the differences between voxels `lag` apart along x.

    first  first bin of the float32 numbers that have the same upper 15 bits
    edges  ends of the bins, rising; larger differences count in the last bin
    """
    counts, bins = np.zeros(len(edges) - 1, np.int64), len(edges) - 1
    width = max(min(own[2, 1], field.shape[2] - lag) - own[2, 0], 0)
    sizes = np.empty(width, np.float32)
    bits = sizes.view(np.uint32)
    for z in range(own[0, 0], own[0, 1]):
        for y in range(own[1, 0], own[1, 1]):
            here, there = field[z, y, own[2, 0] :], field[z, y, own[2, 0] + lag :]
            out, beyond = padding[z, y, own[2, 0] :], padding[z, y, own[2, 0] + lag :]
            for x in range(width):
                sizes[x] = abs(there[x] - here[x])
            for x in range(width):
                if out[x] or beyond[x]:
                    continue
                size, b = np.float64(sizes[x]), first[bits[x] >> 17]
                while b + 1 < bins and edges[b + 1] <= size:
                    b += 1
                counts[b] += 1
    return counts
