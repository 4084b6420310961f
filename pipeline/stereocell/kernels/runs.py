"""Connected components of a mask, by its runs: contiguous voxels along x, few in each row.

K. Wu, E. Otoo & K. Suzuki, "Optimizing two-pass connected-component labeling algorithms", Pattern
Analysis and Applications 12, 2009. doi:10.1007/s10044-008-0109-y
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel
from stereocell.kernels.union_find import link, number_components

Ints = NDArray[np.int32]
Mask = NDArray[np.bool_]


@kernel
def find_runs(mask: Mask) -> tuple[NDArray[np.int64], Ints, Ints]:
    """Return the index of the first run of each row (rows + 1,), and where runs start and stop.

    mask  bool (z, y, x); rows are ordered by z and then by y
    """
    depth, height, width = mask.shape
    first = np.zeros(depth * height + 1, np.int64)
    count = 0
    for z in range(depth):
        for y in range(height):
            row, was_set = mask[z, y], False
            for x in range(width):
                count += row[x] & (not was_set)
                was_set = row[x]
            first[z * height + y + 1] = count
    start, stop = np.empty(count, np.int32), np.empty(count, np.int32)
    place = 0
    for z in range(depth):
        for y in range(height):
            row, was_set = mask[z, y], False
            if first[z * height + y + 1] == place:
                continue
            for x in range(width):
                if row[x] != was_set:
                    if was_set:
                        stop[place] = x
                        place += 1
                    else:
                        start[place] = x
                    was_set = row[x]
            if was_set:
                stop[place] = width
                place += 1
    return first, start, stop


@kernel
def join_runs(
    first: NDArray[np.int64], start: Ints, stop: Ints, height: int, by_corners: bool
) -> tuple[Ints, Ints, int]:
    """Return the connected components of a mask, from its runs.

    height      number of rows in a plane
    by_corners  whether voxels that share only an edge or a corner are connected, too
    result      component of each run, from 0 on; number of its voxels that share a face with a
                voxel of an earlier row; number of components
    """
    parent = np.arange(len(start)).astype(np.int32)
    touching = np.zeros(len(start), np.int32)
    reach = 1 if by_corners else 0
    for row in range(len(first) - 1):
        z, y = row // height, row % height
        for k in range(4 if by_corners else 2):
            dz = 0 if k == 0 else 1
            dy = 1 if k in (0, 2) else (0 if k == 1 else -1)
            if dz > z or not 0 <= y - dy < height:
                continue
            other = row - dz * height - dy
            i, j = first[row], first[other]
            while i < first[row + 1] and j < first[other + 1]:
                if start[i] < stop[j] + reach and start[j] < stop[i] + reach:
                    link(parent, i, j)
                    if k < 2:
                        touching[i] += max(0, min(stop[i], stop[j]) - max(start[i], start[j]))
                if stop[i] < stop[j]:
                    i += 1
                else:
                    j += 1
    labels, count = number_components(parent)
    return labels, touching, count


@kernel
def measure_components(
    first: NDArray[np.int64],
    start: Ints,
    stop: Ints,
    labels: Ints,
    touching: Ints,
    count: int,
    shape: tuple[int, int, int],
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.int64]]:
    """Return the bounding boxes of components, and their numbers of voxels and of faces.

    result  boxes (count, 6), least and largest voxel (z, y, x); numbers of voxels (count,); numbers
            of their faces (count,) towards voxels of the array outside of the component
    """
    depth, height, width = shape
    boxes = np.empty((count, 6), np.int32)
    boxes[:, :3], boxes[:, 3:] = max(shape[0], max(height, width)), -1
    voxels, faces = np.zeros(count, np.int64), np.zeros(count, np.int64)
    for row in range(len(first) - 1):
        z, y = row // height, row % height
        sides = (z > 0) + (z < depth - 1) + (y > 0) + (y < height - 1)
        for i in range(first[row], first[row + 1]):
            box, label = boxes[labels[i]], labels[i]
            box[0], box[1], box[2] = min(box[0], z), min(box[1], y), min(box[2], start[i])
            box[3], box[4], box[5] = max(box[3], z), max(box[4], y), max(box[5], stop[i] - 1)
            length = stop[i] - start[i]
            voxels[label] += length
            faces[label] += (start[i] > 0) + (stop[i] < width) + sides * length - 2 * touching[i]
    return boxes, voxels, faces


@kernel
def mark_runs(
    first: NDArray[np.int64], start: Ints, stop: Ints, labels: Ints, chosen: Mask, mask: Mask
) -> None:
    """Set the voxels of the chosen components (count,) in a mask (z, y, x)."""
    height = mask.shape[1]
    for row in range(len(first) - 1):
        line = mask[row // height, row % height]
        for i in range(first[row], first[row + 1]):
            if chosen[labels[i]]:
                line[start[i] : stop[i]] = True
