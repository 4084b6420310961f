"""Cut the voxels of a tile's volume out of those that were read. Pure."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.isosurface.holder import Holder
from stereocell.model.lattice import Lattice
from stereocell.model.tile_content import APRON
from stereocell.model.tiling import Box


def cut_voxels(voxels: NDArray[Any], lattice: Lattice, holder: Holder | None) -> NDArray[Any]:
    """Return the lattice's voxels and an apron (z, y, x); the region's ends repeat.

    voxels  (z, y, x), of the lattice's window
    holder  what the surface leaves out, as a table: it is air, so that volume and surface agree
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
