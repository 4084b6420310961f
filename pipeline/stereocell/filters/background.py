"""The background of a channel: smooth, dataset-wide, subtracted before iso-values are found.

Stray light and autofluorescence lie under a stain and vary over a tile; one level can't serve both
its bright and its dark side. Space is split into blocks as large as the largest bodies. A low
percentile of a block's voxels is its background, as long as bodies leave that share free. The field
is linear between the blocks' centres and on to the ends of what is built, so neighbouring tiles
see the same value at the same place.

Where the background rises within a block, a low percentile is that of its dark side. So what is
found is subtracted, and the same is done again with what remains. Bodies on a ground that rises to
three times their height: Dice .37 where the field was constant beyond the outermost centres, .93 on
to the ends; with three passes in place of six it was .14 (docs/decisions/levels.md).
"""

from itertools import pairwise, product
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.model.lattice_field import LatticeField
from stereocell.model.spacing import Spacing
from stereocell.model.tiling import Box

PERCENTILE = 15.0  # percent of a block's voxels that are at most the background
SMOOTHING = 0.7  # sigma in blocks; lowers a block that a body fills completely
PASSES = 6


def find_background(
    field: NDArray[Any],
    region: Box,
    *,
    spacing_um: Spacing,
    block_um: float,
    padding: NDArray[np.bool_] | None = None,
    passes: int = PASSES,
) -> LatticeField:
    """Return the background of a channel, in voxel values.

    field       (z, y, x), voxel values; covers `region` at any resolution
    region      voxels of the level that is built
    spacing_um  (z, y, x), of the region's level
    block_um    aim for the edge of a block; knots lie at the blocks' centres and at the ends
    padding     bool (z, y, x), voxels of the field that take no part; None: all do
    passes      fewer are enough for an estimate
    """
    blocks = [
        max(1, min(n, ceil(size * step / block_um - 0.25)))
        for n, size, step in zip(field.shape, region.shape, spacing_um, strict=True)
    ]
    edges = [
        np.linspace(0, n, count + 1).astype(int)
        for n, count in zip(field.shape, blocks, strict=True)
    ]
    z, y, x = (tuple((a + b - 1) / 2 for a, b in pairwise(edge.tolist())) for edge in edges)
    inner = np.zeros(blocks)
    found = LatticeField((z, y, x), inner)
    for _ in range(passes):
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
        inner = inner + _smooth(knots)
        found = _to_the_ends(LatticeField((z, y, x), inner), field.shape)
    z, y, x = (
        tuple(float(start + (centre + 0.5) * size / n - 0.5) for centre in centres)
        for centres, start, size, n in zip(
            found.centres, region.start, region.shape, field.shape, strict=True
        )
    )
    return LatticeField((z, y, x), found.values)


def _to_the_ends(lattice: LatticeField, shape: tuple[int, ...]) -> LatticeField:
    """Return the lattice with knots at the ends of the field, in line with the two next to them.

    Beyond the outermost blocks' centres a lattice is constant, and a background seldom is.
    """
    values, axes = lattice.values, []
    for axis, (centres, n) in enumerate(zip(lattice.centres, shape, strict=True)):
        if len(centres) > 1:
            ends = []
            for end, a, b in ((-0.5, 0, 1), (n - 0.5, -1, -2)):
                near, next_one = np.take(values, a, axis), np.take(values, b, axis)
                away = (end - centres[a]) / (centres[b] - centres[a])
                ends.append(np.expand_dims(near + away * (next_one - near), axis))
            values = np.concatenate([ends[0], values, ends[1]], axis)
            centres = (-0.5, *centres, n - 0.5)
        axes.append(centres)
    z, y, x = axes
    return LatticeField((z, y, x), values)


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
