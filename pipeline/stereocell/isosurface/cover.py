"""Measure how well a surface encloses the source's voxels above its level.

The stated distances of a surface are measured on the filtered field, so they do not show what the
filter removed. Therefore the solid is also compared with the voxels as they were read.

All voxels are compared, even if the surface was extracted from only some planes of voxels. The
solid is linear between these planes, and constant beyond the last one.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.isosurface.holder import Holder
from stereocell.model.lattice import Lattice, Step
from stereocell.model.lattice_field import LatticeField
from stereocell.model.unit import Cover


def measure_cover(
    voxels: NDArray[Any],
    distance: NDArray[np.float32],
    lattice: Lattice,
    step: Step,
    *,
    iso: LatticeField,
    background: LatticeField | None,
    holder: Holder | None,
) -> Cover:
    """Return how the solid of one tile covers the source's voxels above the level.

    voxels      (z, y, x) as read, the lattice's window
    distance    float32 of the repaired solid, positive inside, the thinned lattice's window
    step        voxels (z, y, x) between the planes from which the surface was extracted
    iso         level above the background, voxel values
    background  voxel values; None: none was subtracted
    holder      pieces that are left out of the surface, and so of the count; None: nothing is
    """
    own = tuple(
        slice(a - low, b - low)
        for a, b, low in zip(lattice.own.start, lattice.own.stop, lattice.window.start, strict=True)
    )
    level = iso.at(lattice.window)
    if background is not None:
        level = level + background.at(lattice.window)
    levels = np.broadcast_to(level, voxels.shape)[own]
    left_out = None
    if holder is not None:
        left_out = np.broadcast_to(holder.at(lattice.window), voxels.shape)[own]
    source, both, solid = 0, 0, 0
    for z, field in enumerate(planes_between(distance, lattice, step)):
        is_above = voxels[own][z] > levels[z]
        if left_out is not None:
            is_above &= ~left_out[z]
        is_inside = field > 0
        source += int(np.count_nonzero(is_above))
        solid += int(np.count_nonzero(is_inside))
        both += int(np.count_nonzero(is_above & is_inside))
    return Cover(source, both, solid)


def planes_between(
    field: NDArray[np.float32], lattice: Lattice, step: Step
) -> Iterator[NDArray[np.float32]]:
    """Yield a field of the thinned lattice's window at each z of the tile's own points, (y, x).

    The field is linear between two planes of the thinned lattice, and constant beyond the last one.
    """
    first = lattice.thinned(step).window.start
    z, y, x = (
        _find_neighbours(axis, lattice, step[axis], first[axis], field.shape[axis])
        for axis in range(3)
    )
    for low, high, share in zip(*z, strict=True):
        plane = field[low]
        if step[0] > 1:
            plane = plane + (field[high] - plane) * share
        for axis, (lows, highs, shares) in enumerate((y, x)):
            below = plane.take(lows, axis)
            if step[axis + 1] > 1:
                shares = shares[:, None] if axis == 0 else shares
                below += (plane.take(highs, axis) - below) * shares
            plane = below
        yield plane


def _find_neighbours(
    axis: int, lattice: Lattice, step: int, first: int, count: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """Return the two planes beside each of the tile's own points along an axis, and the share.

    first, count  index of the first plane, and the number of planes
    result        indices of the planes below and above, and the way between them, 0..1
    """
    points = np.arange(lattice.own.start[axis], lattice.own.stop[axis])
    if step == 1:  # planes of the window, which are not counted from the region's start
        low = points - lattice.window.start[axis]
        return low, low, np.zeros(len(low), np.float32)
    planes, past = np.divmod(points - lattice.region.start[axis], step)
    low = np.clip(planes - first, 0, count - 1)
    return low, np.minimum(low + 1, count - 1), (past / step).astype(np.float32)
