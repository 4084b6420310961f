"""The background under a channel: smooth, dataset-wide, subtracted before any iso-value is sought.

Stains sit on light that comes from elsewhere and varies over a tile; one level can't serve both its
bright and its dark side. In blocks as large as the largest bodies a low percentile of the voxels is
background, as long as the bodies leave that share free; between the blocks' centres it runs
linearly, so that neighbouring tiles see the same value at the same place.
"""

from itertools import pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box

PERCENTILE = 15.0
SMOOTHING = 0.7  # sigma, in blocks: a block that a body fills all the same is drawn down


def find_background(
    field: NDArray[Any],
    region: Box,
    *,
    spacing_um: tuple[float, float, float],
    block_um: float,
) -> LatticeField:
    """Return the background of `field`, (z, y, x), which covers `region` at any resolution.

    Knots lie at the centres of blocks of about `block_um`, in voxels of the region's level, whose
    spacing is `spacing_um`.
    """
    blocks = [
        max(1, min(n, round(size * step / block_um)))
        for n, size, step in zip(field.shape, region.shape, spacing_um, strict=True)
    ]
    edges = [
        np.linspace(0, n, count + 1).astype(int)
        for n, count in zip(field.shape, blocks, strict=True)
    ]
    knots = np.empty(blocks)
    for place in product(*(range(count) for count in blocks)):
        block = tuple(slice(e[i], e[i + 1]) for e, i in zip(edges, place, strict=True))
        # block by block: all of the field as float32 would be what a small build's memory peaks at
        knots[place] = np.percentile(field[block].astype(np.float32), PERCENTILE)
    z, y, x = (
        tuple(float(start + (a + b) / 2 * size / n - 0.5) for a, b in pairwise(edge))
        for edge, start, size, n in zip(edges, region.start, region.shape, field.shape, strict=True)
    )
    return LatticeField((z, y, x), ndimage.gaussian_filter(knots, SMOOTHING, mode="nearest"))
