"""What an edge between two materials, and a material itself, leave in a histogram of value and
gradient magnitude.

Across an edge blurred by a Gaussian of s finest voxels, the value d voxels away is a + (b - a)
Phi(d / s). Central differences along an axis that the edge's normal meets at the cosine n differ by
(b - a) (Phi((d + n) / s) - Phi((d - n) / s)): for a broad edge n times what they are head-on, so
that their length is the same whichever way the edge lies (the arc of Kindlmann & Durkin 1998); for
one sharper than a voxel up to sqrt 3 times as much. So the voxels of one boundary lie on arcs of
all these heights. Here they are counted over normals of all directions, with noise.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from stereocell.transfer.material_peaks import NOISE_FACTOR

DIRECTIONS, PLACES = 128, 96  # of an edge, and across it
COARSER = 4  # columns of the histogram that make one here
BEYOND = 3.0  # sigmas of the blur, to either side of an edge

Ratios = tuple[float, float, float]
Field = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class HistogramGrid:
    """The extent of a joint histogram: its size (rows, columns), the gradient of its last row, and
    its spacings by the finest.

    Columns are already the coarser ones.
    """

    rows: int
    columns: int
    gradient_max: float
    ratios: Ratios


def value_noise(noise: float, gradient_max: float) -> float:
    """Return sigma of the values, 0..1, whose differences have the length that find_noise gives.

    The mode of that length, of three differences of sigma sqrt 2, is 2 sigma.
    """
    return noise * gradient_max / NOISE_FACTOR / 2


def count_edge(low: float, high: float, *, blur: float, sigma: float, grid: HistogramGrid) -> Field:
    """Return the voxels of an edge by gradient and value, (rows, columns), per voxel of its area.

    low, high  values of the materials; sigma: of the values' noise; blur: in finest voxels
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
    """Return a material's voxels by gradient and value, (rows, columns), 1 in sum."""
    squares = sum(
        (np.sqrt(2) * sigma * _CHANCE[axis] / ratio) ** 2 for axis, ratio in enumerate(grid.ratios)
    )
    return _share(value + sigma * _CHANCE[3], np.sqrt(squares), grid)


def find_steepest(blur: float, ratios: Ratios) -> float:
    """Return the longest step of an edge of height 1, in the direction that has it."""
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
# of the differences along each axis, and of the value: the same at every call
_CHANCE = np.random.default_rng(0).standard_normal((4, PLACES, DIRECTIONS))
