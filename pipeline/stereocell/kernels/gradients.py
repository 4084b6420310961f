"""Slopes of a field by central differences, one-sided at the ends, and distances from slopes."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.copying import copy_plane

Field = NDArray[np.float32]
Row = NDArray[np.float64]


@part
def square_slopes(
    before: Field, plane: Field, behind: Field, y: int, factors: Row, ends: Row, squares: Row
) -> None:
    """Write the squared slope at each pixel of a row of a plane.

    before, behind  the planes beside it, or the plane itself at the ends
    factors, ends   1 / (2 h) by axis (z, y, x), and 1 / h for the ends; factors[0] suits this plane
    """
    height, width = plane.shape
    row, above, below = plane[y], plane[max(y - 1, 0)], plane[min(y + 1, height - 1)]
    nearer, farther = before[y], behind[y]
    fz = factors[0]
    fy = factors[1] if 0 < y < height - 1 else ends[1]
    fx = factors[2]
    for x in range(width):
        dz = (np.float64(farther[x]) - np.float64(nearer[x])) * fz
        dy = (np.float64(below[x]) - np.float64(above[x])) * fy
        squares[x] = dz * dz + dy * dy
    for x in range(1, width - 1):
        dx = (np.float64(row[x + 1]) - np.float64(row[x - 1])) * fx
        squares[x] += dx * dx
    if width > 1:
        first = (np.float64(row[1]) - np.float64(row[0])) * ends[2]
        last = (np.float64(row[width - 1]) - np.float64(row[width - 2])) * ends[2]
        squares[0] += first * first
        squares[width - 1] += last * last


@kernel
def measure_slopes(field: Field, steps: Row) -> Field:
    """Return |grad f|, float32 (z, y, x), for steps (z, y, x)."""
    depth, height, width = field.shape
    ends, factors = 1 / steps, 0.5 / steps
    slopes, squares = np.empty(field.shape, np.float32), np.empty(width)
    for z in range(depth):
        before, behind = field[max(z - 1, 0)], field[min(z + 1, depth - 1)]
        factors[0] = 0.5 * ends[0] if 0 < z < depth - 1 else ends[0]
        for y in range(height):
            square_slopes(before, field[z], behind, y, factors, ends, squares)
            row = slopes[z, y]
            for x in range(width):
                row[x] = np.sqrt(squares[x])
    return slopes


@kernel
def divide_by_slopes(field: Field, steps: Row, least: float, limit: float) -> None:
    """Replace f by f / (|grad f| + least), clipped to +- limit, in place. f is (z, y, x)."""
    depth, height, width = field.shape
    ends, factors = 1 / steps, 0.5 / steps
    before, plane, squares = field[0].copy(), field[0].copy(), np.empty(width)
    for z in range(depth):
        behind = field[z + 1] if z + 1 < depth else plane
        factors[0] = 0.5 * ends[0] if 0 < z < depth - 1 else ends[0]
        for y in range(height):
            square_slopes(before, plane, behind, y, factors, ends, squares)
            row, values = field[z, y], plane[y]
            for x in range(width):
                far = np.float64(values[x]) / (np.sqrt(squares[x]) + least)
                row[x] = min(max(far, -limit), limit)
        before, plane = plane, before
        if z + 1 < depth:
            copy_plane(field[z + 1], plane)


@kernel
def move_off_zero(values: Field, least: np.float32) -> None:
    """Move values (z, y, x) nearer to 0 than `least` to +- least, in place; 0 becomes -least."""
    for z in range(values.shape[0]):
        for y in range(values.shape[1]):
            row = values[z, y]
            for x in range(len(row)):
                if -least < row[x] < least:
                    row[x] = least if row[x] > 0 else -least
