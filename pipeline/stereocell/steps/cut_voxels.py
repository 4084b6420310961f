"""Cut the voxels of a tile's volume out of the voxels that were read."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.isosurface.holder import Holder
from stereocell.model.lattice import Lattice
from stereocell.model.tile_content import APRON
from stereocell.model.tiling import Box


def cut_voxels(voxels: NDArray[Any], lattice: Lattice, holder: Holder | None) -> NDArray[Any]:
    """Return the lattice's voxels with an apron, (z, y, x). It repeats voxels at the region's ends.

    voxels  voxels (z, y, x) of the lattice's window
    holder  a CT's table or head holder, which the surface leaves out. It becomes air, so that
            volume and surface agree; None: there is none
    """
    own, region, start = lattice.own, lattice.region, lattice.window.start
    inside, beyond, firsts, ends = [], [], [], []
    for a, b, low, high, w in zip(
        own.start, own.stop, region.start, region.stop, start, strict=True
    ):
        first, end = max(a - APRON, low), min(b + APRON, high)
        firsts.append(first)
        ends.append(end)
        inside.append(slice(first - w, end - w))
        beyond.append((first - (a - APRON), b + APRON - end))
    kept = voxels[tuple(inside)]
    if holder is not None:
        (z0, y0, x0), (z1, y1, x1) = firsts, ends
        kept = holder.left_out_of(kept, Box((z0, y0, x0), (z1, y1, x1)))
    return np.pad(kept, beyond, mode="edge")
