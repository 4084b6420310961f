"""Read a label map coarsely: the blocks of voxels that belong to objects, and objects' borders."""

import numpy as np
from numpy.typing import NDArray

from stereocell.live.coarse_channel import CoarseChannel, grid_at, in_blocks, slabs_of
from stereocell.planning.plan import Plan
from stereocell.steps.labels import Labels
from stereocell.steps.open_source import open_source

_BORDER = 0.4  # 0..1, factor for blocks at an object's border, so that touching objects look apart


def read_coarse_labels(plan: Plan, labels: Labels, voxels: int) -> CoarseChannel:
    """Return the objects of a label map as at most `voxels` blocks.

    The value of a block is the share, 0..1, of its voxels that belong to the object in its middle,
    times _BORDER at an object's border. The finest level is read, as in a build, since coarser
    levels may contain averages of object numbers.

    Raises SourceError if voxels can't be read, or are not numbers of objects.
    """
    dataset, numbers = open_source(labels.ref), labels.open()
    grid, axis = grid_at(dataset, plan, 0, voxels), dataset.slice_axis(0)
    shares, middles = [], []
    for slab, block in slabs_of(grid, axis):
        parts = in_blocks(numbers.read(slab), block)
        z, y, x = (size // 2 for size in block)
        middle = parts[:, z, :, y, :, x]
        same = parts == middle[:, None, :, None, :, None]
        shares.append(same.mean(axis=(1, 3, 5), dtype=np.float32) * (middle > 0))
        middles.append(middle)
    share, middle = np.concatenate(shares, axis), np.concatenate(middles, axis)
    values = share * np.where(_is_border(middle), np.float32(_BORDER), np.float32(1))
    return CoarseChannel(values.astype(np.float32), grid, values.ravel())


def _is_border(numbers: NDArray[np.unsignedinteger]) -> NDArray[np.bool_]:
    """Return the blocks whose next block along any axis is another object's, bool (z, y, x)."""
    found = np.zeros(numbers.shape, np.bool_)
    for axis in range(3):
        moved, other = np.moveaxis(found, axis, 0), np.moveaxis(numbers, axis, 0)
        moved[:-1] |= (other[:-1] != other[1:]) & (other[1:] > 0)
    return found
