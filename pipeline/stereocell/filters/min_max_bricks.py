"""Data that a ray-marcher needs beside the voxels: mip levels, and the value range of each brick.

Every mip level covers the same box: level k has max(1, n >> k) voxels along an axis of n voxels. If
n is odd, a coarser voxel is the mean of the voxels that it covers, weighted by the covered share
(polyphase box filter). Bricks are min-max blocks, extended by one voxel on each side, because
trilinear interpolation reaches that far.

References
S. Guthe & P. Heckbert, "Non-power-of-two mipmap creation", NVIDIA, 2005.
S. Parker, P. Shirley, Y. Livnat, C. Hansen & P.-P. Sloan, "Interactive ray tracing for isosurface
rendering", IEEE Visualization 1998.
"""

import numpy as np
from numpy.typing import NDArray

SKIP_BRICK = 8  # edge of a brick in voxels, a power of two; the viewer's build reads this line
SMALLEST_LEVEL = 4  # voxels; the last mip level has no axis longer than this


def mip_levels(volume: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    """Return the volume and its coarser levels, finest first.

    volume  uint8 (z, y, x)
    result  uint8 (z, y, x) each. Means are kept in float32 between levels, and rounded at each

    >>> [level.shape for level in mip_levels(np.zeros((16, 12, 5), np.uint8))]
    [(16, 12, 5), (8, 6, 2), (4, 3, 1)]
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

    volume  uint8 (z, y, x)

    Along an axis of n voxels there are ceil(n / SKIP_BRICK) bricks. Brick b begins at voxel
    i = SKIP_BRICK * b and covers [i - 1, i + SKIP_BRICK], clipped to the volume. So a trilinear
    sample between the outer faces of the brick's own voxels reads no other voxel.

    >>> volume = np.zeros((8, 8, 24), np.uint8)
    >>> volume[:, :, 9:12] = 200
    >>> min_max_bricks(volume)[0, 0].tolist()  # only the middle brick can show anything
    [[0, 0], [0, 200], [0, 0]]
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
    source = np.moveaxis(values, axis, 0)
    n = len(source)
    reduced = source[0:n:SKIP_BRICK].copy()
    for k in range(1, SKIP_BRICK):
        part = source[k:n:SKIP_BRICK]
        ufunc(reduced[: len(part)], part, out=reduced[: len(part)])
    after = source[SKIP_BRICK::SKIP_BRICK]  # the first voxel of the next brick
    ufunc(reduced[: len(after)], after, out=reduced[: len(after)])
    before = source[SKIP_BRICK - 1 : n - 1 : SKIP_BRICK]  # the last voxel of the previous brick
    ufunc(reduced[1:], before, out=reduced[1:])
    return np.moveaxis(reduced, 0, axis)
