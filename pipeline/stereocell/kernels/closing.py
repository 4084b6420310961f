"""Close a solid by a ball that rolls outside of it, using exact distances in a band around it.

Squared distances are computed plane by plane: by two sweeps along x, and along y and z as the
minimum over the few rows and planes within reach. Planes out of reach are overwritten, so the
distances of a whole window are never in memory together.

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
def _square_in_plane(
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
def _least_over_planes(
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
def close_gaps(distance: Field, steps: NDArray[np.float64], radius: float, inset: float) -> None:
    """Add to a solid, in place, the voxels that a ball rolling outside cannot reach.

    distance  float32 (z, y, x), um, positive inside
    steps     spacing (z, y, x), um
    radius    radius of the ball, um
    inset     um; the surface of the added part lies this much inside. Its distance is clipped to
              `inset` inside and to twice `inset` outside.
    """
    nz, ny, nx = distance.shape
    hz, hy, hx = steps
    # The centre of a ball that touches the window may lie in a margin around it.
    mz, my, mx = int(radius / hz) + 2, int(radius / hy) + 2, int(radius / hx) + 2
    depth, height, width = nz + 2 * mz, ny + 2 * my, nx + 2 * mx
    is_centre = np.empty((depth, height, width), np.bool_)
    lines, least = np.empty((height, width), np.float32), np.empty(width, np.float32)
    solid = np.zeros((height, width), np.bool_)
    bound = np.float32(radius) * np.float32(radius)
    far = 4 * radius * radius
    rz, ry = int(radius / hz) + 1, int(radius / hy) + 1
    ring = np.empty((2 * rz + 1, height, width), np.float32)
    for z in range(depth + rz):
        if z < depth:
            plane = ring[z % len(ring)]
            if mz <= z < mz + nz:
                for y in range(ny):
                    row, line = distance[z - mz, y], solid[y + my]
                    for x in range(nx):
                        line[x + mx] = row[x] > 0
                _square_in_plane(solid, plane, lines, ry, hy, hx, far)
            else:
                plane[:] = np.float32(far)
        done = z - rz
        if done < 0:
            continue
        for y in range(height):
            _least_over_planes(ring, done, depth, y, rz, hz, least)
            row = is_centre[done, y]
            for x in range(width):
                row[x] = least[x] >= bound
    reach = radius + 2 * inset
    far = 4 * reach * reach
    rz, ry = int(reach / hz) + 1, int(reach / hy) + 1
    ring = np.empty((2 * rz + 1, height, width), np.float32)
    middle = np.float32(radius + inset)
    low, high = np.float32(-2 * inset), np.float32(inset)
    for z in range(depth + rz):
        if z < depth:
            _square_in_plane(is_centre[z], ring[z % len(ring)], lines, ry, hy, hx, far)
        done = z - rz
        if not mz <= done < mz + nz:
            continue
        for y in range(ny):
            _least_over_planes(ring, done, depth, y + my, rz, hz, least)
            row = distance[done - mz, y]
            for x in range(nx):
                added = np.sqrt(least[x + mx]) - middle
                row[x] = max(row[x], min(max(added, low), high))
