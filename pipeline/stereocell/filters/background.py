"""The background of a channel: smooth, dataset-wide, subtracted before iso-values are found.

Stray light and autofluorescence lie under a stain and vary over a tile; one level can't serve both
its bright and its dark side. Space is split into blocks as large as the largest bodies. A low
percentile of a block's voxels is its background, as long as bodies leave that share free. The field
is linear between the blocks' centres, so neighbouring tiles see the same value at the same place.

Where the background rises within a block, a low percentile is that of its dark side. So what is
found is subtracted, and the same is done again with what remains: on 48 tiles of known solids
(`make bench-iso`) the best level's mean Dice is .80 without a background, .82 after one pass and
.84 after three.
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
PASSES = 3


def find_background(
    field: NDArray[Any],
    region: Box,
    *,
    spacing_um: tuple[float, float, float],
    block_um: float,
    padding: NDArray[np.bool_] | None = None,
) -> LatticeField:
    """Return the background of a channel, in voxel values.

    field       (z, y, x), voxel values; covers `region` at any resolution
    region      voxels of the level that is built
    spacing_um  (z, y, x), of the region's level
    block_um    aim for the edge of a block; knots lie at the blocks' centres
    padding     bool (z, y, x), voxels of the field that take no part; None: all do
    """
    blocks = [
        max(1, min(n, round(size * step / block_um)))
        for n, size, step in zip(field.shape, region.shape, spacing_um, strict=True)
    ]
    edges = [
        np.linspace(0, n, count + 1).astype(int)
        for n, count in zip(field.shape, blocks, strict=True)
    ]
    z, y, x = (tuple((a + b - 1) / 2 for a, b in pairwise(edge.tolist())) for edge in edges)
    found = LatticeField((z, y, x), np.zeros(blocks))
    for _ in range(PASSES):
        knots = np.full(blocks, np.nan)
        for place in product(*(range(count) for count in blocks)):
            sides = [(int(e[i]), int(e[i + 1])) for e, i in zip(edges, place, strict=True)]
            block = tuple(slice(*side) for side in sides)
            (z0, z1), (y0, y1), (x0, x1) = sides
            # block by block: the whole field as float32 would set the peak memory of a small build
            rest = field[block].astype(np.float32) - found.at(Box((z0, y0, x0), (z1, y1, x1)))
            if padding is not None:
                rest = rest[~padding[block]]
            if rest.size:
                knots[place] = np.percentile(rest, PERCENTILE)
        found = LatticeField((z, y, x), found.values + _smooth(knots))
    z, y, x = (
        tuple(float(start + (centre + 0.5) * size / n - 0.5) for centre in centres)
        for centres, start, size, n in zip(
            found.centres, region.start, region.shape, field.shape, strict=True
        )
    )
    return LatticeField((z, y, x), found.values)


def _smooth(knots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the knots smoothed; those without a value take their neighbours'."""
    is_known = np.isfinite(knots)
    if not is_known.any():
        return np.zeros_like(knots)
    filled = np.where(is_known, knots, 0.0)
    weight = is_known.astype(np.float64)
    sigma = SMOOTHING
    while True:
        around = ndimage.gaussian_filter(weight, sigma, mode="nearest")
        if around.min() > 1e-6:
            break
        sigma *= 2  # a gap wider than the filter
    smoothed = ndimage.gaussian_filter(filled, sigma, mode="nearest") / around
    return np.asarray(smoothed, np.float64)
