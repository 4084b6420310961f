"""Squared distances from the voxels of a mask, exact up to a reach, plane by plane.

They are computed by two sweeps along x, and along y and z as the minimum over the few rows and
planes within reach. Planes out of reach are overwritten, so the distances of a whole window are
never in memory together.

References
P. F. Felzenszwalb & D. P. Huttenlocher, "Distance transforms of sampled functions", Theory of
Computing 8, 2012. doi:10.4086/toc.2012.v008a019
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.copying import copy_row

Field = NDArray[np.float32]
Mask = NDArray[np.bool_]


@part
def square_in_plane(
    solid: Mask, out: Field, lines: Field, reach: int, hy: float, hx: float, far: float
) -> None:
    """Write the squared distance of each pixel from the nearest solid pixel in its plane.

    solid  (height, width)
    out    (height, width), written; values are at most `far`
    lines  (height, width), working memory
    reach  number of rows that are examined on each side
    hy     distance of neighbouring rows, um; hx: of neighbouring pixels in a row
    far    largest squared distance that is needed, um^2
    """
    height, width = solid.shape
    square = np.float32(hx) * np.float32(hx)
    for y in range(height):
        row, line = solid[y], lines[y]
        steps = np.float32(width + 1e6)
        for x in range(width):
            steps = np.float32(0) if row[x] else steps + np.float32(1)
            line[x] = steps
        steps = np.float32(width + 1e6)
        for x in range(width - 1, -1, -1):
            steps = np.float32(0) if row[x] else steps + np.float32(1)
            line[x] = min(line[x], steps)
        for x in range(width):
            line[x] = min(line[x] * line[x] * square, np.float32(far))
    for y in range(height):
        row = out[y]
        copy_row(lines[y], row)
        for j in range(1, reach + 1):
            away = np.float32(j) * np.float32(j) * np.float32(hy) * np.float32(hy)
            for other in (y - j, y + j):
                if 0 <= other < height:
                    line = lines[other]
                    for x in range(width):
                        row[x] = min(row[x], line[x] + away)


@part
def least_over_planes(
    ring: Field, z: int, depth: int, y: int, reach: int, hz: float, least: Field
) -> None:
    """Write the squared distance of each voxel of a row from the solid in all planes in reach."""
    copy_row(ring[z % len(ring), y], least)
    for j in range(1, reach + 1):
        away = np.float32(j) * np.float32(j) * np.float32(hz) * np.float32(hz)
        for other in (z - j, z + j):
            if 0 <= other < depth:
                line = ring[other % len(ring), y]
                for x in range(len(least)):
                    least[x] = min(least[x], line[x] + away)


@kernel
def find_far(mask: Mask, steps: NDArray[np.float64], distance: float) -> Mask:
    """Return the voxels (z, y, x) that are farther than a distance from all voxels of a mask.

    steps     spacing (z, y, x), um
    distance  um; voxels beyond the window's ends do not count
    """
    depth, height, width = mask.shape
    hz, hy, hx = steps
    square = np.float32(distance) * np.float32(distance)
    far = 4 * distance * distance
    rz, ry = int(distance / hz) + 1, int(distance / hy) + 1
    found = np.empty(mask.shape, np.bool_)
    lines, least = np.empty((height, width), np.float32), np.empty(width, np.float32)
    ring = np.empty((min(2 * rz + 1, depth), height, width), np.float32)
    for z in range(depth + rz):
        if z < depth:
            square_in_plane(mask[z], ring[z % len(ring)], lines, ry, hy, hx, far)
        done = z - rz
        if not 0 <= done < depth:
            continue
        for y in range(height):
            least_over_planes(ring, done, depth, y, rz, hz, least)
            row = found[done, y]
            for x in range(width):
                row[x] = least[x] > square
    return found
