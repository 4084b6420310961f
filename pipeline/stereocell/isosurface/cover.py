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
from stereocell.kernels.solid_counts import count_inside
from stereocell.model.lattice import Lattice, Step
from stereocell.model.lattice_field import LatticeField
from stereocell.model.unit import Cover

_PLANES = 16  # planes that are compared at once


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
    places = [_between_planes(distance.shape, lattice, step, axis) for axis in range(3)]
    in_plane = places[1:]
    source = solid = covered = 0
    own = lattice.own
    for z in range(own.start[0], own.stop[0], _PLANES):
        slab = own.slab(0, z, min(z + _PLANES, own.stop[0]))
        level = iso.at(slab)
        if background is not None:
            level = level + background.at(slab)
        is_above = voxels[slab.slices_in(lattice.window)] > level
        if holder is not None:
            is_above &= ~holder.at(slab)
        along_z = [part[z - own.start[0] : slab.stop[0] - own.start[0]] for part in places[0]]
        low, high, share = (np.concatenate(parts) for parts in zip(along_z, *in_plane, strict=True))
        inside, both = count_inside(distance, is_above, low, high, share)
        source, solid, covered = source + int(is_above.sum()), solid + inside, covered + both
    return Cover(source, covered, solid)


def _between_planes(
    shape: tuple[int, ...], lattice: Lattice, step: Step, axis: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """Return between which planes of the thinned lattice's window the tile's own points lie.

    The result is the plane before each point, the plane behind it, and the share of the way between
    them, 0..1. Past the last plane both are the last one.
    """
    every, last = step[axis], shape[axis] - 1
    points = np.arange(lattice.own.start[axis], lattice.own.stop[axis])
    first = lattice.window.start[axis]
    if every > 1:
        points -= lattice.region.start[axis]
        first = lattice.thinned(step).window.start[axis]
    planes, past = np.divmod(points, every)
    low = np.clip(planes - first, 0, last)
    return low, np.minimum(low + 1, last), (past / every).astype(np.float32)
