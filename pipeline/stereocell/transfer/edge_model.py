"""Model the voxels that an edge, and a material, have in a histogram of value and gradient.

Across an edge blurred by a Gaussian of s finest voxels, the value d voxels away is a + (b - a)
Phi(d / s). Along an axis at the cosine n to the edge's normal, the central difference is
(b - a) (Phi((d + n) / s) - Phi((d - n) / s)). For a broad edge that is n times the difference along
the normal, so the gradient's length does not depend on the edge's direction (the arc of Kindlmann &
Durkin). For an edge sharper than a voxel it is up to sqrt 3 times as long. So the voxels of one
boundary lie on arcs of all these heights. Here they are counted over normals of all directions,
with noise.

References
G. Kindlmann & J. W. Durkin, "Semi-automatic generation of transfer functions for direct volume
rendering", IEEE Symposium on Volume Visualization 1998. doi:10.1145/288126.288167
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from stereocell.transfer.material_peaks import NOISE_FACTOR

DIRECTIONS, PLACES = 128, 96  # number of directions of an edge, and of points across it
COARSER = 4  # number of columns of the histogram that are merged into one here
BEYOND = 3.0  # sigmas of the blur that are counted on each side of an edge

Ratios = tuple[float, float, float]
Field = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class HistogramGrid:
    """The extent of a joint histogram.

    rows, columns  number of rows, and of columns after merging
    gradient_max   gradient magnitude of the last row
    ratios         voxel spacings divided by the finest one, (z, y, x)
    """

    rows: int
    columns: int
    gradient_max: float
    ratios: Ratios


def value_noise(noise: float, gradient_max: float) -> float:
    """Return the standard deviation of the values' noise, 0..1, from a result of `find_noise`.

    The length of a vector of three differences, each of sigma sqrt 2, has its mode at 2 sigma.
    """
    return noise * gradient_max / NOISE_FACTOR / 2


def count_edge(low: float, high: float, *, blur: float, sigma: float, grid: HistogramGrid) -> Field:
    """Return the voxels of an edge by gradient and value, per voxel of the edge's area.

    low, high  values of the two materials, 0..1
    blur       sigma of the edge's blur, in finest voxels
    sigma      standard deviation of the values' noise, 0..1
    result     float64 (rows, columns)
    """
    reach = BEYOND * blur + max(grid.ratios)
    at = (2 * (np.arange(PLACES) + 0.5) / PLACES - 1) * reach
    squares = np.zeros((PLACES, DIRECTIONS))
    for axis, ratio in enumerate(grid.ratios):
        aside = _NORMALS[:, axis] * ratio
        step = ndtr((at[:, np.newaxis] + aside) / blur) - ndtr((at[:, np.newaxis] - aside) / blur)
        squares += (((high - low) * step + np.sqrt(2) * sigma * _CHANCE[axis]) / ratio) ** 2
    values = low + (high - low) * ndtr(at / blur)[:, np.newaxis] + sigma * _CHANCE[3]
    return 2 * reach * _share(values, np.sqrt(squares), grid)


def count_material(value: float, sigma: float, grid: HistogramGrid) -> Field:
    """Return a material's share of voxels by gradient and value, float64 (rows, columns); sum 1.

    value, sigma  value of the material, and standard deviation of its noise, 0..1
    """
    squares = sum(
        (np.sqrt(2) * sigma * _CHANCE[axis] / ratio) ** 2 for axis, ratio in enumerate(grid.ratios)
    )
    return _share(value + sigma * _CHANCE[3], np.sqrt(squares), grid)


def find_steepest(blur: float, ratios: Ratios) -> float:
    """Return the longest gradient of an edge of height 1, over all directions.

    blur    sigma of the edge's blur, in finest voxels
    ratios  voxel spacings divided by the finest one, (z, y, x)
    """
    squares = sum(
        (2 * ndtr(_NORMALS[:, i] * r / blur) - 1) ** 2 / r**2 for i, r in enumerate(ratios)
    )
    return float(np.sqrt(squares).max())


def _share(values: Field, gradients: Field, grid: HistogramGrid) -> Field:
    row = np.minimum(gradients / grid.gradient_max * (grid.rows - 1) + 0.5, grid.rows - 1)
    column = np.clip(values, 0, 1 - 1e-9) * grid.columns
    cell = row.astype(np.intp) * grid.columns + column.astype(np.intp)
    counts = np.bincount(cell.ravel(), minlength=grid.rows * grid.columns)
    return counts.reshape(grid.rows, grid.columns) / cell.size


def _directions() -> Field:
    """Return unit vectors spread evenly over an octant, (DIRECTIONS, 3): a Fibonacci lattice."""
    i = np.arange(DIRECTIONS)
    up = (i + 0.5) / DIRECTIONS
    turn = np.pi / 2 * ((i * (5**0.5 - 1) / 2) % 1)
    flat = np.sqrt(1 - up**2)
    return np.stack([up, flat * np.cos(turn), flat * np.sin(turn)], axis=1)


_NORMALS = _directions()
# Random numbers for the noise of the differences along three axes and of the value, for each point
# across an edge and each direction; the same in every call
_CHANCE = np.random.default_rng(0).standard_normal((4, PLACES, DIRECTIONS))
