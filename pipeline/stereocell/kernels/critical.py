"""Find places where a label touches itself only by an edge or a corner of voxels."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.half_edges import Ints

WIDTH = 8  # largest number of voxels that describe a place, see `find_critical`


@part
def _note(found: NDArray[np.int64], count: int, a: int, b: int, c: int, d: int) -> int:
    if count < len(found):
        found[count, :] = -1
        found[count, 0], found[count, 1], found[count, 2], found[count, 3] = a, b, c, d
    return count + 1


@kernel
def find_critical(labels: Ints, most: int) -> tuple[NDArray[np.int64], int]:
    """Return the places, int64 (k, 8), of which at most `most`, and their total number.

    labels  int32 (z, y, x), 0 outside

    A place lists flat indices of voxels: two of one label, then voxels around them of other labels,
    then -1 to the end. There are three kinds of place: a square of 2 x 2 with the label on one
    diagonal only; a cube of 2 x 2 x 2 with the label at two opposite corners only; and a cube with
    the label everywhere except at two opposite corners, whose first voxel is listed twice.
    """
    depth, height, width = labels.shape
    flat = labels.ravel()
    found, count = np.empty((most, WIDTH), np.int64), 0
    steps = (height * width, width, 1)
    for z in range(depth):
        for y in range(height):
            for x in range(width):
                i = (z * height + y) * width + x
                ends = (z + 1 < depth, y + 1 < height, x + 1 < width)
                for axis in range(3):
                    if not ends[(axis + 1) % 3] or not ends[(axis + 2) % 3]:
                        continue
                    j, k = i + steps[(axis + 1) % 3], i + steps[(axis + 2) % 3]
                    m = j + k - i
                    a, b, c, d = flat[i], flat[j], flat[k], flat[m]
                    if a == d and a > 0 and a not in (b, c):
                        count = _note(found, count, i, m, j, k)
                    if b == c and b > 0 and b not in (a, d):
                        count = _note(found, count, j, k, i, m)
                if not (ends[0] and ends[1] and ends[2]):
                    continue
                for corner in range(4):
                    p = i + (corner // 2) * steps[1] + (corner % 2) * steps[2]
                    # In the cube of 2 x 2 x 2 voxels, corner o is opposite to corner p.
                    o = i + steps[0] + (1 - corner // 2) * steps[1] + (1 - corner % 2) * steps[2]
                    a, b, rest = flat[p], flat[o], -1
                    is_lone, is_hole = a == b and a > 0, True
                    for other in range(8):
                        q = i + (other // 4) * steps[0]
                        q += (other // 2 % 2) * steps[1] + (other % 2) * steps[2]
                        if q in (p, o):
                            continue
                        is_lone = is_lone and flat[q] != a
                        rest = q if rest < 0 else rest
                        is_hole = is_hole and flat[q] == flat[rest]
                    if is_lone:
                        if count < most:
                            found[count, 0], found[count, 1], place = p, o, 2
                            for other in range(8):
                                q = i + (other // 4) * steps[0]
                                q += (other // 2 % 2) * steps[1] + (other % 2) * steps[2]
                                if q not in (p, o):
                                    found[count, place] = q
                                    place += 1
                        count += 1
                    elif is_hole and flat[rest] > 0 and flat[rest] not in (a, b):
                        count = _note(found, count, rest, rest, p, o)
    return found[: min(count, most)], count
