"""Read a channel coarsely: only as many voxels as a first view needs, even of a large source."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.tile_content import APRON
from stereocell.model.tiling import Box
from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan
from stereocell.read import Dataset

READ_VOXELS = 48_000_000  # most voxels that are read of a channel
SLAB_VOXELS = 16_000_000  # approximate number of voxels that are read at a time
SAMPLED_VOXELS = 6_000_000  # approximate number of values from which a window is found
OnRead = Callable[[float], None]
_Triple = tuple[int, int, int]
_Places = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True, slots=True)
class CoarseGrid:
    """The blocks of voxels that are averaged.

    level   resolution level of the source that is read
    box     the planned region, in voxels of that level
    factor  (z, y, x), voxels of a block, in voxels of that level
    first   (z, y, x), centre of the first block, in voxels of the planned level
    step    (z, y, x), distance between blocks, in voxels of the planned level
    """

    level: int
    box: Box
    factor: _Triple
    first: tuple[float, float, float]
    step: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class CoarseChannel:
    """The means of blocks of a channel's voxels, over the planned region.

    voxels  float32 (z, y, x), means in the unit of the voxels
    grid    places of the blocks
    sample  float32 (n,), values before averaging, for histograms
    """

    voxels: NDArray[np.float32]
    grid: CoarseGrid
    sample: NDArray[np.float32]

    def averaged(self, blocks: int) -> "CoarseChannel":
        """Return means over `blocks` blocks along each axis, or over all along a short axis."""
        if blocks == 1:
            return self
        z, y, x = (min(blocks, n) for n in self.voxels.shape)
        first, step = self.grid.first, self.grid.step
        places = [a + (n - 1) / 2 * h for a, n, h in zip(first, (z, y, x), step, strict=True)]
        apart = [n * h for n, h in zip((z, y, x), step, strict=True)]
        grid = replace(
            self.grid,
            first=(places[0], places[1], places[2]),
            step=(apart[0], apart[1], apart[2]),
        )
        return replace(self, voxels=_means(self.voxels, (z, y, x)), grid=grid)

    def at(self, places: _Places) -> NDArray[np.float32]:
        """Return the values at places on a grid, by linear interpolation; float32 (z, y, x).

        places  the grid's coordinates along z, y and x, in voxels of the planned level; a place
                outside gets the value at the border
        """
        values = self.voxels
        for axis, along in enumerate(places):
            last = values.shape[axis] - 1
            index = np.clip((along - self.grid.first[axis]) / self.grid.step[axis], 0, last)
            low = np.minimum(index.astype(np.intp), max(last - 1, 0))
            share = (index - low).astype(np.float32)
            share = share.reshape([-1 if i == axis else 1 for i in range(3)])
            below, above = values.take(low, axis), values.take(np.minimum(low + 1, last), axis)
            values = below + share * (above - below)
        return values


def find_grid(dataset: Dataset, plan: Plan, voxels: int) -> CoarseGrid:
    """Divide the planned region into at most `voxels` blocks with about equal edges in um.

    In a source with a pyramid, the blocks lie in the finest level whose region has at most
    READ_VOXELS voxels, or at most `voxels` if that is more.
    """
    level = plan.level
    while level + 1 < len(dataset.levels) and prod(_region_at(dataset, plan, level).shape) > max(
        READ_VOXELS, voxels
    ):
        level += 1
    return grid_at(dataset, plan, level, voxels)


def grid_at(dataset: Dataset, plan: Plan, level: int, voxels: int) -> CoarseGrid:
    """Divide the planned region into blocks of one level of a source; see `find_grid`."""
    box = _region_at(dataset, plan, level)
    spacing, origin = dataset.levels[level].spacing_um, dataset.levels[level].origin_um
    factor = _factor(box.shape, spacing, voxels)
    # Places are converted from voxels of this level to voxels of the planned level.
    fine = plan.spacing_um
    first = tuple(
        (origin[i] + (box.start[i] + (factor[i] - 1) / 2) * spacing[i] - plan.origin_um[i])
        / fine[i]
        for i in range(3)
    )
    z, y, x = (float(f * (a / b)) for f, a, b in zip(factor, spacing, fine, strict=True))
    return CoarseGrid(level, box, factor, (first[0], first[1], first[2]), (z, y, x))


def slabs_of(grid: CoarseGrid, axis: int) -> Iterator[tuple[Box, _Triple]]:
    """Yield each box of voxels to read, and the voxels (z, y, x) of a block in it.

    axis  0, 1 or 2 for z, y or x: the axis perpendicular to the source's images

    All planes of a block are read. If the region has more than READ_VOXELS, only the planes in the
    middle of each block are.
    """
    box, factor = grid.box, grid.factor
    count = max(1, min(factor[axis], READ_VOXELS * factor[axis] // prod(box.shape)))
    z, y, x = (count if i == axis else factor[i] for i in range(3))
    # If all planes are read, many blocks are read together, since a chunk holds several planes.
    together = max(1, SLAB_VOXELS // (prod(box.shape) // box.shape[axis] * factor[axis]))
    step = factor[axis] * (together if count == factor[axis] else 1)
    end = box.start[axis] + box.shape[axis] // factor[axis] * factor[axis]
    for start in range(box.start[axis], end, step):
        middle = start + (factor[axis] - count) // 2
        stop = min(start + step, end) if step > factor[axis] else middle + count
        yield box.slab(axis, middle, stop), (z, y, x)


def read_coarse(
    dataset: Dataset,
    plan: Plan,
    channel: Channel,
    voxels: int,
    on_read: OnRead = lambda share: None,
) -> CoarseChannel:
    """Return the means of a channel's blocks; see `find_grid`.

    on_read  called after each part that is read, with the part's share, 0..1

    In a large source without a pyramid, only some of the source's images in each block are read.
    Raises SourceError if voxels can't be read.
    """
    grid = find_grid(dataset, plan, voxels)
    axis = dataset.slice_axis(grid.level)
    blocks, sample = [], []
    slabs = list(slabs_of(grid, axis))
    for slab, block in slabs:
        read = dataset.read(channel.index, slab, grid.level).voxels
        blocks.append(_means(read, block))
        planes = blocks[-1].shape[axis] * grid.factor[axis]
        sample.append(_spread(read, round(SAMPLED_VOXELS * planes / grid.box.shape[axis])))
        on_read(1 / len(slabs))
    return CoarseChannel(np.concatenate(blocks, axis), grid, np.concatenate(sample))


def places_in(lattice: Box, step: tuple[float, float, float]) -> _Places:
    """Return the places (z, y, x) of a tile's volume, in voxels of the planned level.

    lattice  the tile's lattice points

    Along each axis the places are about `step` apart, from the first lattice point to the last.
    APRON more places lie beyond each end.
    """
    z, y, x = (
        _along(start, stop - 1, apart)
        for start, stop, apart in zip(lattice.start, lattice.stop, step, strict=True)
    )
    return z, y, x


def _along(first: int, last: int, step: float) -> NDArray[np.float64]:
    count = max(2, round((last - first) / step) + 1) if last > first else 1
    apart = (last - first) / (count - 1) if count > 1 else step
    return np.asarray(first + apart * np.arange(-APRON, count + APRON), np.float64)


def _region_at(dataset: Dataset, plan: Plan, level: int) -> Box:
    """Return the planned region in voxels of another level, rounded outwards."""
    shape, coarse = dataset.levels[plan.level].shape, dataset.levels[level].shape
    start = [a * n // m for a, n, m in zip(plan.region.start, coarse, shape, strict=True)]
    stop = [-(-b * n // m) for b, n, m in zip(plan.region.stop, coarse, shape, strict=True)]
    return Box((start[0], start[1], start[2]), (stop[0], stop[1], stop[2]))


def _factor(shape: _Triple, spacing: tuple[float, float, float], voxels: int) -> _Triple:
    """Return the voxels (z, y, x) of a block such that at most `voxels` blocks fill a shape."""
    edge = (prod(n * s for n, s in zip(shape, spacing, strict=True)) / voxels) ** (1 / 3)
    while True:
        z, y, x = (min(max(1, round(edge / s)), n) for n, s in zip(shape, spacing, strict=True))
        if (shape[0] // z) * (shape[1] // y) * (shape[2] // x) <= voxels:
            return z, y, x
        edge *= 1.05


def in_blocks(voxels: NDArray[Any], block: _Triple) -> NDArray[Any]:
    """Reshape voxels into complete blocks: (z, block z, y, block y, x, block x)."""
    counts = [n // size for n, size in zip(voxels.shape, block, strict=True)]
    whole = voxels[tuple(slice(0, n * size) for n, size in zip(counts, block, strict=True))]
    z, y, x = counts
    return whole.reshape(z, block[0], y, block[1], x, block[2])


def _means(voxels: NDArray[Any], block: _Triple) -> NDArray[np.float32]:
    """Return the means of complete blocks, float32 (z, y, x)."""
    counts = [n // size for n, size in zip(voxels.shape, block, strict=True)]
    total = voxels[tuple(slice(0, n * size) for n, size in zip(counts, block, strict=True))]
    for axis, size in enumerate(block):  # one `mean` over all axes would take five times as long
        along = np.moveaxis(total, axis, 0)
        added = along[::size].astype(np.float32)
        for k in range(1, size):
            added += along[k::size]
        total = np.moveaxis(added, 0, axis)
    return np.ascontiguousarray(total / np.float32(prod(block)), np.float32)


def _spread(voxels: NDArray[np.generic], most: int) -> NDArray[np.float32]:
    """Return at most `most` values, spread evenly over the voxels."""
    every = -(-voxels.size // max(1, most))
    return voxels.reshape(-1)[:: every + (every % 2 == 0)].astype(np.float32)
