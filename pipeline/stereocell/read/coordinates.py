"""Stated positions of voxels along one axis: their step, its direction, and how even it is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_EVEN = 0.02  # share of the mean step by which any step may differ from it


@dataclass(frozen=True, slots=True)
class Steps:
    """The steps along an axis.

    mean            signed, in the positions' unit; negative: the positions descend
    least, largest  sizes of the steps, 0 or more
    """

    mean: float
    least: float
    largest: float

    @property
    def is_even(self) -> bool:
        """Whether all steps are equally long, except for rounding."""
        mean = abs(self.mean)
        return max(self.largest - mean, mean - self.least) <= _EVEN * mean


def steps_of(positions: NDArray[np.float64] | Sequence[float], count: int) -> Steps | None:
    """Return the steps between the positions of `count` voxels.

    positions  one for each voxel; or one more, for the voxels' edges, as in NeXus; or only the
               first two, as in EMD for even steps

    None: the number of positions is none of these, or they neither rise nor fall throughout.

    >>> steps_of([3.0, 2.0, 0.0], 3)
    Steps(mean=-1.5, least=1.0, largest=2.0)
    """
    found = np.asarray(positions, np.float64).ravel()
    if count < 2 or len(found) not in (2, count, count + 1) or not np.isfinite(found).all():
        return None
    steps = np.diff(found)
    if not ((steps > 0).all() or (steps < 0).all()):
        return None
    sizes = np.abs(steps)
    mean = float((found[-1] - found[0]) / (len(found) - 1))
    return Steps(mean, float(sizes.min()), float(sizes.max()))
