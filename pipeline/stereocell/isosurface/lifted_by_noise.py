"""Estimate how many voxels noise alone lifts above a level. They are not structure that is missing.

Each voxel is its denoised value plus noise. So the histogram of the denoised values, on which the
level was found, gives the number of voxels that noise is expected to lift above the level.

Far below the level only noise lifts voxels. Near the level, a thin wall that the filters flattened
has the same values as the rim of a thick body, so near and far voxels are counted apart. FAR was
tuned on shells of 1 to 3 voxels with noise of up to a tenth of their height. It finds the missing
share of these shells to within .05. On nuclei in noise of a third of their height the share found
is 2 %, although 88 % of the voxels above the level lie outside of the solid.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

# Standard deviations of the noise; a denoised value is far if it is this much below the level
FAR = 0.5


@dataclass(frozen=True, slots=True)
class Lifted:
    """Expected numbers of voxels that noise lifts above a level.

    far   among voxels with a denoised value far below the level
    near  among voxels with a denoised value below the level, but not far below
    """

    far: float
    near: float

    def __add__(self, other: "Lifted") -> "Lifted":
        return Lifted(self.far + other.far, self.near + other.near)


def count_lifted(
    counts: NDArray[np.int64], edges: NDArray[np.float64], *, level: float, noise: float
) -> Lifted:
    """Return how many voxels noise is expected to lift above a level.

    counts  number of voxels by denoised value, (n,)
    edges   ends of the bins of `counts`, (n + 1,), rising, voxel values
    noise   standard deviation, voxel values; 0: no noise
    """
    if not noise > 0:
        return Lifted(0.0, 0.0)
    below = (level - (edges[1:] + edges[:-1]) / 2) / noise
    expected = np.where(below > 0, counts * ndtr(-below), 0.0)
    is_far = below >= FAR
    return Lifted(float(expected[is_far].sum()), float(expected[~is_far].sum()))
