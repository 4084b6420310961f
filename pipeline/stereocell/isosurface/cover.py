"""How well a surface holds the voxels that the source has above its level.

A surface's stated distances are measured on the filtered field, and say nothing about what the
filter removed. So the solid is compared with the voxels as they were read, too.
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

    voxels      as read, (z, y, x), of the lattice's window
    distance    float32 of the repaired solid, positive inside, of the thinned lattice's window
    step        voxels (z, y, x) between planes that carry the surface
    iso         above the background, voxel values
    holder      what is left out of the surface, and of the count; None: nothing is
    """
    thin = lattice.thinned(step)
    kept = lattice.slices_of_thinned(step)
    own = tuple(
        slice(a - low, b - low)
        for a, b, low in zip(thin.own.start, thin.own.stop, thin.window.start, strict=True)
    )
    level = iso.at(lattice.window)
    if background is not None:
        level = level + background.at(lattice.window)
    is_above = (voxels > level)[kept][own]
    if holder is not None:
        is_above &= ~np.broadcast_to(holder.at(lattice.window), voxels.shape)[kept][own]
    is_inside = distance[own] > 0
    source, solid = int(is_above.sum()), int(is_inside.sum())
    return Cover(source, int((is_above & is_inside).sum()), solid)
