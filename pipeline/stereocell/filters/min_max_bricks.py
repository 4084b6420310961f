"""What a ray-marcher wants beside the voxels: mip levels and the value range of each brick.

Mip levels are box-filtered so that every level covers the same box: level k has max(1, n >> k)
voxels along an axis of n, and where n is odd the voxels are averaged by the share of them that
the coarser voxel covers (polyphase box filter; Guthe & Heckbert, "Non-Power-of-Two Mipmap
Creation", NVIDIA 2005). Bricks follow the min-max blocks of Parker et al., IEEE Visualization
1998, grown by the voxel on each side that trilinear interpolation can reach.
"""

import numpy as np
from numpy.typing import NDArray

SKIP_BRICK = 8  # voxels along a brick's edge, a power of two; the viewer's build reads it here
SMALLEST_LEVEL = 4  # no further mip level once no axis is longer


def mip_levels(volume: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    """Return the volume (z, y, x) and its coarser levels, finest first, each uint8 (z, y, x).

    Averages are kept in float32 from level to level and rounded once a level.
    """
    levels = [volume]
    average: NDArray[np.uint8] | NDArray[np.float32] = volume
    while max(average.shape) > SMALLEST_LEVEL:
        for axis in range(3):
            average = _halve(average, axis)
        levels.append((average + np.float32(0.5)).astype(np.uint8))
    return levels


def min_max_bricks(volume: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the smallest and largest voxel of each brick: uint8 (bz, by, bx, 2).

    Along an axis of n voxels there are ceil(n / SKIP_BRICK) bricks; brick b begins at voxel
    i = SKIP_BRICK * b and covers [i - 1, i + SKIP_BRICK], clipped to the volume: all that a
    trilinear sample between the outer faces of its own voxels can touch.
    """
    low, high = volume, volume
    for axis in range(3):
        low = _reduce(np.minimum, low, axis)
        high = _reduce(np.maximum, high, axis)
    return np.stack([low, high], axis=-1)


def _halve(
    values: NDArray[np.uint8] | NDArray[np.float32], axis: int
) -> NDArray[np.uint8] | NDArray[np.float32]:
    n = values.shape[axis]
    m = n // 2
    if m == 0:
        return values

    def every_second(start: int) -> NDArray[np.uint8] | NDArray[np.float32]:
        taken = [slice(None)] * 3
        taken[axis] = slice(start, start + 2 * m - 1, 2)
        return values[tuple(taken)]

    if n == 2 * m:
        return np.add(every_second(0), every_second(1), dtype=np.float32) * np.float32(0.5)
    shape = [1, 1, 1]
    shape[axis] = m
    i = np.arange(m, dtype=np.float32).reshape(shape)
    total: NDArray[np.float32] = every_second(0) * ((m - i) / np.float32(n))
    total += every_second(1) * np.float32(m / n)
    total += every_second(2) * ((i + 1) / np.float32(n))
    return total


def _reduce(ufunc: np.ufunc, values: NDArray[np.uint8], axis: int) -> NDArray[np.uint8]:
    n = values.shape[axis]
    reduced: NDArray[np.uint8] = ufunc.reduceat(values, np.arange(0, n, SKIP_BRICK), axis=axis)
    moved, source = np.moveaxis(reduced, axis, 0), np.moveaxis(values, axis, 0)
    after = source[SKIP_BRICK::SKIP_BRICK]  # the first voxel of the next brick
    ufunc(moved[: len(after)], after, out=moved[: len(after)])
    before = source[SKIP_BRICK - 1 : n - 1 : SKIP_BRICK]  # the last voxel of the brick before
    ufunc(moved[1:], before, out=moved[1:])
    return reduced
