"""The noise of a channel, measured where its voxels stand: how far smoothing may move a value.

Along a thin wall values change slowly, and across it fast, so the slowest of four directions in the
plane of the images shows noise and no structure. It is measured by the second difference, which an
even slope leaves at 0. Photons have more noise where there are more of them, so voxels are split
into ten classes by brightness. The noise is that of the noisiest class but two: each class holds a
tenth of the voxels, and thin bright structures fill at most two. Even padding has no noise to
measure, and is left out.

The volumes of `make bench-iso` that hold 1 % of bodies give the deviation of their noise within a
tenth; a CT of a head gives 4 HU.

References
J. Immerkaer, "Fast noise variance estimation", Computer Vision and Image Understanding 64(2), 1996
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

CLASSES = 10
NOISIEST = -3  # place of the class that is taken, by noise
# Where even padding fills more than this share, all else are bodies and their edges: of vessels cut
# out of a CT six classes in ten are edges. There the middle class is taken.
MAX_EVEN, MIDDLE = 0.8, CLASSES // 2 - 1
STRIDE = 8  # of so many slices one is looked at
MASK_SHIFT = 0.4  # of a mask's step: under a half, so that each voxel stays on its side of the edge
_ALONG = ((0, 1), (1, 0), (1, 1), (1, -1))  # pixels (row, column) from a voxel to its neighbour
_KEPT = 0.75  # share of a class's differences, the least, whose mean is taken
_OF_NORMAL = 0.43468  # that mean for noise of deviation 1


class NoiseSample:
    """Differences between neighbours, gathered from one block after another."""

    def __init__(self) -> None:
        self._least: list[NDArray[np.float32]] = []
        self._bright: list[NDArray[np.float32]] = []
        self._looked_at = 0

    def add(self, voxels: NDArray[Any], darkest: float | None = None) -> None:
        """Look at some slices of a block (slice, row, column) of any number type.

        darkest  the value of padding; None: there is none
        """
        slices = voxels[len(voxels) % STRIDE // 2 :: STRIDE].astype(np.float32)
        if min(slices.shape) < 1 or min(slices.shape[1:]) < 3:
            return
        apart = [_second_difference(slices, row, column) for row, column in _ALONG]
        least = np.minimum.reduce(apart)
        bright = ndimage.uniform_filter(slices, (1, 3, 3))[:, 1:-1, 1:-1]
        is_padding = np.zeros(least.shape, bool)
        if darkest is not None:
            is_even = np.maximum.reduce(apart) == 0
            is_padding = is_even & (slices[:, 1:-1, 1:-1] == darkest)
        self._looked_at += least.size
        self._least.append(least[~is_padding])
        self._bright.append(bright[~is_padding])

    def deviation(self) -> float:
        """Return the noise's standard deviation, voxel values; 0: there is none."""
        measured = sum(map(len, self._least))
        if not measured:
            return 0.0
        place = NOISIEST if measured >= (1 - MAX_EVEN) * self._looked_at else MIDDLE
        least, bright = np.concatenate(self._least), np.concatenate(self._bright)
        order = np.argsort(bright, kind="stable")
        classes = [_typical(least[part]) for part in np.array_split(order, CLASSES)]
        return sorted(classes)[place]


def find_max_shift(noise: float, deviations: float, mask: tuple[float, float] | None) -> float:
    """Return how far smoothing may move a voxel's value, in voxel values.

    noise       its standard deviation, voxel values
    deviations  of the noise, that a value may be moved by
    mask        the only two values that the voxels have; None: they have more
    """
    return deviations * noise if mask is None else MASK_SHIFT * (mask[1] - mask[0])


def _second_difference(slices: NDArray[np.float32], row: int, column: int) -> NDArray[np.float32]:
    """Return how far each inner pixel is from the mean of two opposite neighbours, doubled."""
    height, width = slices.shape[1:]

    def shifted(down: int, right: int) -> NDArray[np.float32]:
        return slices[:, 1 + down : height - 1 + down, 1 + right : width - 1 + right]

    return np.abs(shifted(row, column) + shifted(-row, -column) - 2 * shifted(0, 0))


def _typical(differences: NDArray[np.float32]) -> float:
    """Return the deviation of noise that has such differences: the largest of them are edges."""
    if not len(differences):
        return 0.0
    kept = max(1, int(_KEPT * len(differences)))
    least = np.partition(differences, kept - 1)[:kept]
    return float(least.mean(dtype=np.float64)) / _OF_NORMAL
