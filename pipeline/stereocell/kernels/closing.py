"""Close a solid by a ball that rolls outside of it, using exact distances in a band around it."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel
from stereocell.kernels.plane_distances import Field, least_over_planes, square_in_plane


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
                square_in_plane(solid, plane, lines, ry, hy, hx, far)
            else:
                plane[:] = np.float32(far)
        done = z - rz
        if done < 0:
            continue
        for y in range(height):
            least_over_planes(ring, done, depth, y, rz, hz, least)
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
            square_in_plane(is_centre[z], ring[z % len(ring)], lines, ry, hy, hx, far)
        done = z - rz
        if not mz <= done < mz + nz:
            continue
        for y in range(ny):
            least_over_planes(ring, done, depth, y + my, rz, hz, least)
            row = distance[done - mz, y]
            for x in range(nx):
                added = np.sqrt(least[x + mx]) - middle
                row[x] = max(row[x], min(max(added, low), high))
