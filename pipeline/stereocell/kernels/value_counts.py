"""Histograms of values in even bins. NumPy's take ten times as long, mostly for copies."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel


@kernel
def count_values(
    values: NDArray[np.float64],
    times: NDArray[np.int64],
    edges: NDArray[np.float64],
    low: float,
    high: float,
    clips: bool,
    counts: NDArray[np.int64],
) -> None:
    """Add the number of values in each bin.

    values     (n,); NaN is left out
    times      (n,), how many times each value counts
    edges      ends of the bins (bins + 1,), evenly spaced; the last bin holds its upper end, too
    low, high  least and largest value that is counted, within the edges
    clips      whether values beyond them are clipped to them; otherwise they are left out
    counts     (bins,)
    """
    bins = len(counts)
    scale = bins / (edges[bins] - edges[0])
    for k in range(len(values)):
        value = values[k]
        if clips:
            value = min(max(value, low), high)
        if not low <= value <= high:
            continue
        place = (value - edges[0]) * scale
        at = int(place) if place < bins else bins - 1  # NaN, too, where the bins have no width
        # Rounding may have moved a value that lies near an edge.
        if value < edges[at]:
            at -= 1
        elif at + 1 < bins and value >= edges[at + 1]:
            at += 1
        counts[at] += times[k]


@kernel
def count_codes(codes: NDArray[np.uint16], counts: NDArray[np.int64]) -> None:
    """Add the number of times that each code occurs.

    codes   (n,)
    counts  (65536,)
    """
    for code in codes:
        counts[np.uint64(code)] += 1  # an index without a sign needs no check


@kernel
def look_up(codes: NDArray[np.uint16], table: NDArray[np.uint8], found: NDArray[np.uint8]) -> None:
    """Write the table's value for each code.

    codes, found  (n,)
    table         (65536,)
    """
    for k in range(len(codes)):
        found[k] = table[np.uint64(codes[k])]


@kernel
def measure_steps(
    voxels: NDArray[np.uint8], ratios: NDArray[np.float32], steps: NDArray[np.float32]
) -> None:
    """Write the length of the step over two voxels along each axis, for all inner voxels.

    voxels  (z, y, x)
    ratios  (3,), factors on the steps along z, y and x
    steps   (z - 2, y - 2, x - 2)
    """
    depth, height, width = steps.shape
    for z in range(depth):
        for y in range(height):
            row, line = steps[z, y], voxels[z + 1, y + 1]
            before, behind = voxels[z, y + 1], voxels[z + 2, y + 1]
            above, below = voxels[z + 1, y], voxels[z + 1, y + 2]
            for x in range(width):
                dz = (np.float32(behind[x + 1]) - np.float32(before[x + 1])) * ratios[0]
                dy = (np.float32(below[x + 1]) - np.float32(above[x + 1])) * ratios[1]
                dx = (np.float32(line[x + 2]) - np.float32(line[x])) * ratios[2]
                row[x] = np.sqrt(dz * dz + dy * dy + dx * dx)


@kernel
def count_steps(
    steps: NDArray[np.float32],
    plane: NDArray[np.uint8],
    factor: np.float32,
    counts: NDArray[np.int64],
) -> None:
    """Count the inner voxels of a plane by gradient magnitude and value.

    steps   (y - 2, x - 2)
    plane   (y, x), values
    factor  rows for each step of a value
    counts  (rows, 256), to which the voxels are added; the last row counts steeper voxels, too
    """
    height, width = steps.shape
    last, half = np.float32(len(counts) - 1), np.float32(0.5)
    rows = np.empty(width, np.int32)
    for y in range(height):
        line, row = plane[y + 1], steps[y]
        for x in range(width):
            rows[x] = np.int32(min(row[x] * factor + half, last))
        for x in range(width):
            counts[np.uint64(rows[x]), np.uint64(line[x + 1])] += 1
