"""Whether neighbouring voxels have anything to do with one another, as they are measured.

A microscope's image is blurred, so that what is there reaches into several voxels; a camera's noise
is drawn for each by itself. Denoised, both have grains. The correlation of neighbours in plane was
at most .003 in empty fields of five cameras, of counted photons and of a clipped detector, where
light is even; at least .045 on all volumes with bodies of `make bench-iso`, as of 1 % of membranes
at 10 photons.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

MIN_KINSHIP = 0.01  # correlation below which there is nothing but noise
_Slices = tuple[slice, slice, slice]


@dataclass(frozen=True, slots=True)
class Neighbours:
    """Sums over a tile's voxels but for its padding, of values less the scale's middle.

    voxels  count, sum and sum of squares, float64 (3,)
    pairs   of neighbours along y and along x: count and sum of products, float64 (2, 2)
    """

    voxels: NDArray[np.float64]
    pairs: NDArray[np.float64]

    @classmethod
    def of(
        cls,
        voxels: NDArray[Any],
        padding: NDArray[np.bool_],
        own: _Slices,
        scale: tuple[float, float, float],
    ) -> "Neighbours":
        """Return the sums of a tile.

        voxels   (z, y, x), as read, of a window around the tile; padding, bool, the same
        own      the tile in the window
        scale    least, middle and largest value: beyond the ends are hot voxels
        """
        low, middle, high = scale
        single, pairs = np.zeros(3), np.zeros((2, 2))
        z_range, rows, columns = own
        for z in range(z_range.start, z_range.stop):
            plane = np.clip(voxels[z].astype(np.float64), low, high) - middle
            kept = ~padding[z]
            plane[~kept] = 0.0
            inner, is_kept = plane[rows, columns], kept[rows, columns]
            single += (is_kept.sum(), inner.sum(), np.square(inner).sum())
            for axis in range(2):
                ahead = [rows, columns]
                ahead[axis] = slice(ahead[axis].start + 1, ahead[axis].stop + 1)
                there, is_there = plane[tuple(ahead)], kept[tuple(ahead)]
                height, width = there.shape
                both = is_kept[:height, :width] & is_there
                pairs[axis] += (both.sum(), (inner[:height, :width] * there)[both].sum())
        return cls(single, pairs)


def kinship(tiles: Sequence[Neighbours]) -> float:
    """Return the correlation of neighbouring voxels, the larger one of those along y and along x.

    The lines that a microscope scans may differ from one another by more than what is there.
    1 where it is not known: without tiles or pairs, or where all voxels are alike.
    """
    if not tiles:
        return 1.0
    count, total, squares = np.sum([tile.voxels for tile in tiles], axis=0)
    pairs = np.sum([tile.pairs for tile in tiles], axis=0)
    if not count or not pairs[:, 0].all():
        return 1.0
    mean = total / count
    variance = squares / count - mean**2
    if not variance > 0:
        return 1.0
    return float(((pairs[:, 1] / pairs[:, 0] - mean**2) / variance).max())
