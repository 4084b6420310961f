"""Measure how well a surface encloses the source's voxels above its level.

The stated distances of a surface are measured on the filtered field, so they do not show what the
filter removed. Therefore the solid is also compared with the voxels as they were read.

All voxels are compared, even if the surface was extracted from only some planes of voxels. The
solid is linear between these planes, and constant beyond the last one.
"""

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
    is_above = (voxels > level)[own]
    if holder is not None:
        is_above &= ~np.broadcast_to(holder.at(lattice.window), voxels.shape)[own]
    is_inside = between_planes(distance, lattice, step) > 0
    source, solid = int(is_above.sum()), int(is_inside.sum())
    return Cover(source, int((is_above & is_inside).sum()), solid)


def between_planes(field: NDArray[np.float32], lattice: Lattice, step: Step) -> NDArray[np.float32]:
    """Return a field of the thinned lattice's window at all of the tile's own points.

    The field is linear between two planes of the thinned lattice, and constant beyond the last one.
    """
    first = lattice.thinned(step).window.start
    for axis in range(3):
        if step[axis] == 1:
            start = lattice.own.start[axis] - lattice.window.start[axis]
            stop = lattice.own.stop[axis] - lattice.window.start[axis]
            field = field[(slice(None),) * axis + (slice(start, stop),)]
            continue
        points = np.arange(lattice.own.start[axis], lattice.own.stop[axis])
        planes, past = np.divmod(points - lattice.region.start[axis], step[axis])
        last = field.shape[axis] - 1
        low = np.clip(planes - first[axis], 0, last)
        below = np.take(field, low, axis)
        shape = [-1 if axis == k else 1 for k in range(3)]
        share = (past / step[axis]).astype(np.float32).reshape(shape)
        below += (np.take(field, np.minimum(low + 1, last), axis) - below) * share
        field = below
    return field
