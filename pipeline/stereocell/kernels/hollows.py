"""Find hollows that a solid encloses within slices, and measure by what they are surrounded."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part

Mask = NDArray[np.bool_]
Ints = NDArray[np.int32]


@part
def _flood(closed: Mask, width: int, waiting: Ints, count: int) -> None:
    """Close all open pixels that are connected by their sides to the waiting ones.

    closed   (pixels,), the rows of a slice one after another, with a closed margin of one pixel
    width    pixels of a row, margin included
    waiting  the first `count` are closed pixels whose neighbours are still to be examined
    """
    while count > 0:
        count -= 1
        at = waiting[count]
        for near in (at - width, at - 1, at + 1, at + width):
            if not closed[near]:
                closed[near] = True
                waiting[count] = near
                count += 1


@part
def _close_outside(closed: Mask, height: int, width: int, waiting: Ints) -> None:
    """Close all open pixels of a slice except the enclosed ones; see `_flood`.

    height, width  pixels of the slice, margin excluded
    """
    across, count = width + 2, 0
    for row in range(1, height + 1):
        inward = 1 if row in (1, height) else max(width - 1, 1)
        for column in range(1, width + 1, inward):
            at = row * across + column
            if not closed[at]:
                closed[at] = True
                waiting[count] = at
                count += 1
    _flood(closed, across, waiting, count)


@kernel
def find_hollows(solid: Mask) -> Mask:
    """Return the voxels (z, y, x) that a solid encloses within a slice along at least one axis.

    An enclosed voxel lies outside of the solid, and no path of voxels that share a face leads from
    it to the slice's rim.
    """
    shape = solid.shape
    found = np.zeros(shape, np.bool_)
    for axis in range(3):
        height = shape[0] if axis > 0 else shape[1]
        width = shape[2] if axis < 2 else shape[1]
        largest = (height + 2) * (width + 2)
        closed, waiting = np.ones(largest, np.bool_), np.empty(largest, np.int32)
        for place in range(shape[axis]):
            for row in range(height):
                start = (row + 1) * (width + 2) + 1
                for column in range(width):
                    if axis == 0:
                        closed[start + column] = solid[place, row, column]
                    elif axis == 1:
                        closed[start + column] = solid[row, place, column]
                    else:
                        closed[start + column] = solid[row, column, place]
            _close_outside(closed, height, width, waiting)
            for row in range(height):
                start = (row + 1) * (width + 2) + 1
                for column in range(width):
                    if not closed[start + column]:
                        if axis == 0:
                            found[place, row, column] = True
                        elif axis == 1:
                            found[row, place, column] = True
                        else:
                            found[row, column, place] = True
    return found


@kernel
def count_faces(
    labels: NDArray[np.uint32], body: Mask, solid: Mask, count: int
) -> NDArray[np.int64]:
    """Return the number of faces of each hollow at the body and at anything solid, (2, count).

    labels  (z, y, x), number of the hollow of each voxel; 0: none, which is not counted
    count   largest number, plus 1
    """
    depth, height, width = labels.shape
    faces = np.zeros((2, count), np.int64)
    for z in range(depth):
        for y in range(height):
            for x in range(width):
                label = labels[z, y, x]
                if label == 0:
                    continue
                for dz, dy, dx in (
                    (-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1),
                ):  # fmt: skip
                    k, j, i = z + dz, y + dy, x + dx
                    if 0 <= k < depth and 0 <= j < height and 0 <= i < width:
                        faces[0, label] += body[k, j, i]
                        faces[1, label] += solid[k, j, i]
    return faces
