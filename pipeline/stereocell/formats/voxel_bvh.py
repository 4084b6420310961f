"""Bricks of a volume, and the tree over them with each brick's value range and error.

A leaf is a brick of 16^3 texels with one texel of its neighbours on every side, so that trilinear
sampling inside it needs no other brick. Coarser nodes are the averaged bricks of a mip pyramid on
the same grid: node (x, y, z) of level l covers 16 * 2^l texels along an axis.

So the hierarchy is an octree, not a binary tree. Its nodes are the mip bricks that a client draws
until finer ones arrive (Crassin et al.), and each child has eight times its parent's detail. In a
binary tree every second level would have no mip level, and the octree saves a sixth of its data.
There are no pointers: nodes are stored breadth first, with the children of a node side by side.

Texels that the threshold makes invisible are not stored. A node is empty if every texel that can be
sampled in it is at or below the threshold. It is then one record without a brick and without
children.

References
C. Crassin, F. Neyret, S. Lefebvre & E. Eisemann, "GigaVoxels: ray-guided streaming for efficient
and detailed voxel rendering", I3D 2009. doi:10.1145/1507149.1507152
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Texels along a leaf's edge, without the apron; the viewer's build reads this line
STREAM_BRICK = 16
STORED = STREAM_BRICK + 2  # texels along a stored brick's edge
EMPTY = 1  # flag: no brick; every texel is `constant`
_SLAB = 1 << 18  # number of texels that are compared together, so that they stay in the cache

NODE = np.dtype(
    [
        ("level", "u1"),
        ("flags", "u1"),
        ("child_mask", "u1"),
        ("constant", "u1"),
        ("x", "<u2"),
        ("y", "<u2"),
        ("z", "<u2"),
        ("min", "u1"),
        ("max", "u1"),
        ("error_max", "u1"),
        ("error_rms", "<f4"),
    ]
)

Bytes3 = NDArray[np.uint8]
Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Bvh:
    """The octree of bricks over one volume.

    size       texels (z, y, x) of the volume, with the apron
    threshold  largest invisible intensity, 0..254; -1: all texels are visible
    nodes      records of NODE (n,), breadth first from the root (coarsest level) to the leaves:
               level        0: a leaf; a texel of level l averages 2^l texels along an axis
               flags        EMPTY or 0
               child_mask   bit x + 2 y + 4 z: that child is in the table. The children of a node
                            follow one another in the order of their bits, after the children of
                            the previous node
               constant     mean of the texels in its box, rounded
               x, y, z      its box is [x, x + 1) * 16 * 2^level texels, cut off at the volume's end
               min, max     range of all values that are sampled in its box, from its own brick or
                            any below (an empty node is sampled as `constant`)
               error_max    largest absolute difference between the texels in its box and its brick,
                            interpolated trilinearly at their centres; rounded up. 0 in leaves and
                            empty nodes
               error_rms    root mean square of that difference
    bricks     uint8 (n, 18, 18, 18), (z, y, x): one for each node that is not empty, in order
    """

    size: tuple[int, int, int]
    threshold: int
    nodes: NDArray[np.void]
    bricks: Bytes3


def build(volume: Bytes3, threshold: int) -> Bvh:
    """Return the octree of bricks over a volume.

    volume     uint8 (z, y, x)
    threshold  largest invisible intensity, 0..254; -1: all texels are visible

    A coarse texel is the mean of the texels of its cell inside the volume; the last texel replaces
    missing ones. Means are exact, and rounded once. Outside of the volume bricks repeat the nearest
    texel, like GL_CLAMP_TO_EDGE. Raises ValueError for an empty or oversized volume.

    >>> volume = np.zeros((20, 20, 20), np.uint8)
    >>> volume[4:8, 4:8, 4:8] = 200
    >>> bvh = build(volume, 10)
    >>> len(bvh.nodes), bvh.bricks.shape
    (9, (2, 18, 18, 18))
    """
    if volume.ndim != 3 or not volume.size or max(volume.shape) > STREAM_BRICK << 15:
        raise ValueError(f"a volume of {volume.shape} texels")
    pyramid = _make_pyramid(volume)
    means = _cell_means(volume, len(pyramid))
    grids = [mean.shape for mean in means]
    padded = [_pad(level, grid) for level, grid in zip(pyramid, grids, strict=True)]
    low, high = _ranges(padded[0], np.minimum), _ranges(padded[0], np.maximum)
    full = high.astype(np.int16) > threshold
    lows, highs, fulls = [np.where(full, low, means[0])], [np.where(full, high, means[0])], [full]
    for level, mean in enumerate(means[1:], 1):
        full = _reduce_children(np.logical_or, fulls[-1], False)
        low = _reduce_children(np.minimum, lows[-1], 255)
        high = _reduce_children(np.maximum, highs[-1], 0)
        low = np.minimum(low, _ranges(padded[level], np.minimum))
        high = np.maximum(high, _ranges(padded[level], np.maximum))
        fulls.append(full)
        lows.append(np.where(full, low, mean))
        highs.append(np.where(full, high, mean))

    nodes, bricks = [], []
    places = np.zeros((1, 3), dtype=np.int64)  # (z, y, x) of the level's nodes, in order
    for level in reversed(range(len(pyramid))):
        at = tuple(places.T)
        is_full = fulls[level][at]
        found = np.zeros(len(places), dtype=NODE)
        found["level"] = level
        found["flags"] = np.where(is_full, 0, EMPTY)
        found["constant"] = means[level][at]
        found["z"], found["y"], found["x"] = at
        found["min"], found["max"] = lows[level][at], highs[level][at]
        stored = _cut(padded[level], places[is_full])
        if level > 0:
            errors = [
                _error(brick, level, place, volume)
                for brick, place in zip(stored, places[is_full], strict=True)
            ]
            if errors:
                found["error_max"][is_full], found["error_rms"][is_full] = np.array(errors).T
            places, found["child_mask"][is_full] = _children(places[is_full], grids[level - 1])
        nodes.append(found)
        bricks.append(stored)
    z, y, x = volume.shape
    return Bvh((z, y, x), threshold, np.concatenate(nodes), np.concatenate(bricks))


def upsampling(level: int, count: int) -> Floats:
    """Return the weights that interpolate a brick's row at finest texel centres.

    level   level of the brick's node, 0: a leaf
    count   finest texels along the box's axis
    result  float32 (count, 18)

    Finest texel i of the box lies at (i + 1/2) / 2^level + 1/2 in the row, whose texel k has its
    centre at k.
    """
    at = (np.arange(count) + 0.5) / (1 << level) + 0.5
    return np.maximum(0, 1 - abs(at[:, np.newaxis] - np.arange(STORED))).astype(np.float32)


def _make_pyramid(volume: Bytes3) -> list[Bytes3]:
    """Return the mip levels, each half as long as the one before; the last is a single brick."""
    levels = [volume]
    exact: NDArray[np.uint8] | Floats = volume
    while max(levels[-1].shape) > STREAM_BRICK:
        for axis in range(3):
            exact = _halve(exact, axis)
        levels.append((exact + np.float32(0.5)).astype(np.uint8))
    return levels


def _halve(values: NDArray[np.uint8] | Floats, axis: int) -> Floats:
    """Return the means of neighbours along an axis. A last value without a neighbour stays.

    The means are exact up to level 5: texels of level l are multiples of 1/8^l below 256, which
    float32 represents. At deeper levels the error is below 1e-4.
    """
    taken = [slice(None)] * 3
    taken[axis] = slice(0, None, 2)
    first = values[tuple(taken)]
    taken[axis] = slice(1, None, 2)
    second = values[tuple(taken)]
    if second.shape[axis] < first.shape[axis]:
        taken[axis] = slice(-1, None)
        second = np.concatenate([second, values[tuple(taken)]], axis=axis)
    return np.add(first, second, dtype=np.float32) * np.float32(0.5)


def _cell_means(volume: Bytes3, levels: int) -> list[Bytes3]:
    """Return, for each tree level, the rounded mean of the texels in the box of each node."""
    sums: NDArray[Any] = volume
    counts = np.ones((1, 1, 1), dtype=np.int64)
    for axis, n in enumerate(volume.shape):
        starts = np.arange(0, n, STREAM_BRICK)
        # The sum over a brick is at most 16^3 * 255, which uint32 holds.
        sums = np.add.reduceat(sums, starts, axis=axis, dtype=np.uint32)
        shape = [1, 1, 1]
        shape[axis] = len(starts)
        counts = counts * np.diff(np.append(starts, n)).reshape(shape)
    sums = sums.astype(np.int64)
    means = []
    for _ in range(levels):
        means.append(((2 * sums + counts) // (2 * counts)).astype(np.uint8))
        sums = _reduce_children(np.add, sums, 0)
        counts = _reduce_children(np.add, counts, 0)
    return means


def _pad(level: Bytes3, grid: tuple[int, ...]) -> Bytes3:
    """Return the texels of a mip level, with an apron, and with whole bricks at the ends."""
    widths = [(1, g * STREAM_BRICK + 1 - n) for g, n in zip(grid, level.shape, strict=True)]
    return np.pad(level, widths, mode="edge")


def _ranges(padded: Bytes3, ufunc: np.ufunc) -> Bytes3:
    """Return the smallest or largest of the 18^3 texels of each brick of a padded level."""
    values = padded
    for axis in range(3):
        values = np.moveaxis(values, axis, 0)
        core = values[1:-1].reshape(-1, STREAM_BRICK, *values.shape[1:])
        reduced: Bytes3 = ufunc.reduce(core, axis=1)
        ufunc(reduced, values[:-2:STREAM_BRICK], out=reduced)
        ufunc(reduced, values[STREAM_BRICK + 1 :: STREAM_BRICK], out=reduced)
        values = np.moveaxis(reduced, 0, axis)
    return values


def _reduce_children(ufunc: np.ufunc, values: NDArray[Any], neutral: int) -> NDArray[Any]:
    """Return the reduction of every 2 x 2 x 2 nodes; a missing node counts as `neutral`."""
    widths = [(0, n % 2) for n in values.shape]
    values = np.pad(values, widths, constant_values=neutral)
    for axis in range(3):
        taken = [slice(None)] * 3
        taken[axis] = slice(0, None, 2)
        even = values[tuple(taken)]
        taken[axis] = slice(1, None, 2)
        values = ufunc(even, values[tuple(taken)])
    return values


def _cut(padded: Bytes3, places: NDArray[np.int64]) -> Bytes3:
    """Return the bricks (n, 18, 18, 18) at these brick indices (z, y, x) of a padded mip level."""
    windows = np.lib.stride_tricks.sliding_window_view(padded, (STORED,) * 3)
    bricks: Bytes3 = windows[::STREAM_BRICK, ::STREAM_BRICK, ::STREAM_BRICK][tuple(places.T)]
    return bricks


def _children(
    parents: NDArray[np.int64], grid: tuple[int, ...]
) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return the places of all children inside the grid, in order, and each parent's mask."""
    octants = np.array([(i >> 2 & 1, i >> 1 & 1, i & 1) for i in range(8)])
    places = 2 * parents[:, np.newaxis] + octants
    inside = (places < grid).all(axis=2)
    return places[inside], (inside << np.arange(8)).sum(axis=1).astype(np.uint8)


def _error(
    brick: Bytes3, level: int, place: NDArray[np.int64], volume: Bytes3
) -> tuple[int, float]:
    """Return the largest and the root mean square difference of a brick from its texels."""
    edge = STREAM_BRICK << level
    z0, y0, x0 = (int(n) * edge for n in place)
    box = volume[z0 : z0 + edge, y0 : y0 + edge, x0 : x0 + edge]
    weights = [upsampling(level, n) for n in box.shape]
    # The brick's 18 samples along each axis are interpolated at the texels, first along x.
    rows = np.tensordot(brick.astype(np.float32), weights[2], axes=(2, 1))  # (18, 18, x)
    largest, squares = np.float32(0), 0.0
    for z in _slabs(box.shape):
        planes = np.tensordot(weights[0][z], rows, axes=(1, 0))  # (z, 18, x)
        difference = np.matmul(weights[1], planes)
        difference -= box[z]
        flat = difference.ravel()
        largest = max(largest, flat.max(), -flat.min())
        squares += float(np.dot(flat, flat))
    # Rounding errors of float32, about 1e-5, must not raise a whole difference to the next number.
    return int(np.ceil(min(float(largest) - 1e-3, 255))), float(np.sqrt(squares / box.size))


def _slabs(shape: tuple[int, ...]) -> Iterator[slice]:
    step = max(1, _SLAB // (shape[1] * shape[2]))
    for start in range(0, shape[0], step):
        yield slice(start, start + step)
