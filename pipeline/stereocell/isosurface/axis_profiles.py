"""Detect channels that show uneven light and no bodies: their values vary along the axes alone.

The axes are those of `slices_first`: slice, row and column. Light that falls off with depth, a
ramp, stripes and vignetting are nearly sums of a function of the slice, one of the row and one of
the column. Bodies are not. In the volumes of `make bench-iso` the means along the axes explain at
most .45 of the variance. In empty fields and pure texture under such light they explain .86 to 1.0.

A slab of tissue between two dark ends varies from slice to slice alone as well, but its values rise
and fall again. A straight edge of tissue also varies along one axis only, but its level lies in a
valley between two peaks of the histogram. The valley was .6 and deeper in 20 such volumes, and
light makes none. Fields of different brightness side by side look like such an edge and cannot be
distinguished from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.level_sums import sum_along_axes

# Share of the variance along the axes; a channel with more shows light, not bodies
MAX_LIGHT = 0.85
# Sum of all rises and falls from slice to slice over the range; up to this, values count as only
# rising or only falling
_ONE_WAY = 1.25
# Slices averaged before rises and falls are summed, since noise rises and falls everywhere
_BLUR = 8


@dataclass(frozen=True, slots=True)
class Profiles:
    """Sums over a tile's voxels in each plane perpendicular to an axis. Padding is left out.

    start   index (slice, row, column) of the tile's first voxel
    sums    float64, sums of the values by slice, by row and by column
    counts  int64, numbers of voxels by slice, by row and by column
    """

    start: tuple[int, int, int]
    sums: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
    counts: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]

    @classmethod
    def of(
        cls,
        field: NDArray[np.float32],
        padding: NDArray[np.bool_],
        own: tuple[slice, slice, slice],
        start: tuple[int, int, int],
    ) -> "Profiles":
        """Return a tile's profiles over the voxels that are not padding.

        field    (slice, row, column), a window around the tile
        padding  bool, the same window
        own      the tile within the window
        start    index (slice, row, column) of the tile's first voxel in the dataset
        """
        box = np.array([[part.start, part.stop] for part in own], np.int64)
        sz, sy, sx, nz, ny, nx = sum_along_axes(field, padding, box)
        return cls(start, (sz, sy, sx), (nz, ny, nx))

    def followed_by(self, other: "Profiles") -> "Profiles":
        """Return the profiles of a tile from those of its first slices and of all others."""
        (sz, sy, sx), (nz, ny, nx) = self.sums, self.counts
        sums = np.concatenate([sz, other.sums[0]]), sy + other.sums[1], sx + other.sums[2]
        counts = np.concatenate([nz, other.counts[0]]), ny + other.counts[1], nx + other.counts[2]
        return Profiles(self.start, sums, counts)


def share_of_light(
    tiles: Sequence[Profiles], plain: Sequence[Profiles], *, variance: float
) -> float:
    """Return the share of the variance that the means along the axes explain, 0..1.

    tiles     all tiles of the dataset; profiles of the field in which levels are looked for
    plain     all tiles; profiles of the field before subtraction, because a subtracted background
              rises and falls from slice to slice
    variance  of the values in which levels are looked for, without noise
    """
    if not tiles or not variance > 0:
        return 0.0
    found = 0.0
    for axis in range(3):
        means, counts = _means(tiles, axis)
        if len(means) and (axis > 0 or _is_one_way(_means(plain, axis)[0])):
            mean = np.average(means, weights=counts)
            found += float(np.average((means - mean) ** 2, weights=counts))
    return min(found / variance, 1.0)


def _means(tiles: Sequence[Profiles], axis: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean and the number of voxels of each plane at right angles to an axis.

    Planes without counted voxels are left out.
    """
    length = max(tile.start[axis] + len(tile.sums[axis]) for tile in tiles)
    sums, counts = np.zeros(length), np.zeros(length)
    for tile in tiles:
        place = slice(tile.start[axis], tile.start[axis] + len(tile.sums[axis]))
        sums[place] += tile.sums[axis]
        counts[place] += tile.counts[axis]
    has_voxels = counts > 0
    return sums[has_voxels] / counts[has_voxels], counts[has_voxels]


def _is_one_way(means: NDArray[np.float64]) -> bool:
    width = max(1, min(_BLUR, len(means) // 4))
    smooth = np.convolve(means, np.full(width, 1 / width), mode="valid")
    return bool(np.abs(np.diff(smooth)).sum() <= _ONE_WAY * np.ptp(smooth))
