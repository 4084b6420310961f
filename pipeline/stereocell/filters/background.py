"""The background of a channel: smooth, dataset-wide, subtracted before iso-values are found.

Stray light and autofluorescence lie under a stain and vary over a tile; one level can't serve both
its bright and its dark side. Space is split into blocks as large as the largest bodies. A low
percentile of a block's voxels is its background, as long as bodies leave that share free. The field
is linear between the blocks' centres, so neighbouring tiles see the same value at the same place.
"""

from itertools import pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box

PERCENTILE = 15.0  # percent of a block's voxels that are at most the background
SMOOTHING = 0.7  # sigma in blocks; lowers a block that a body fills completely


def find_background(
    field: NDArray[Any],
    region: Box,
    *,
    spacing_um: tuple[float, float, float],
    block_um: float,
) -> LatticeField:
    """Return the background of a channel, in voxel values.

    field       (z, y, x), voxel values; covers `region` at any resolution
    region      voxels of the level that is built
    spacing_um  (z, y, x), of the region's level
    block_um    aim for the edge of a block; knots lie at the blocks' centres
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
        # block by block: the whole field as float32 would set the peak memory of a small build
        knots[place] = np.percentile(field[block].astype(np.float32), PERCENTILE)
    z, y, x = (
        tuple(float(start + (a + b) / 2 * size / n - 0.5) for a, b in pairwise(edge))
        for edge, start, size, n in zip(edges, region.start, region.shape, field.shape, strict=True)
    )
    return LatticeField((z, y, x), ndimage.gaussian_filter(knots, SMOOTHING, mode="nearest"))
