"""Filters applied before a surface is extracted: hot voxels removed, noise smoothed."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.smoothing import smooth_in_place
from stereocell.model.volume import Volume

MEDIAN_REACH = 1  # voxels that the median reaches in plane
SMOOTHING_REACH = 4.0  # radius of the Gaussian, in sigmas


def denoise(volume: Volume, sigma_um: float) -> NDArray[np.float32]:
    """Return the voxels after a 3 x 3 median in plane and a Gaussian.

    The median removes hot voxels, which a Gaussian would spread.

    sigma_um  sigma of the Gaussian; 0 turns it off
    result    float32 (z, y, x), voxel values
    """
    return _filtered(volume, sigma_um, True)


def smooth(volume: Volume, sigma_um: float) -> NDArray[np.float32]:
    """Return the voxels after a Gaussian of sigma `sigma_um` (0: none); float32 (z, y, x)."""
    return _filtered(volume, sigma_um, False)


def _filtered(volume: Volume, sigma_um: float, has_median: bool) -> NDArray[np.float32]:
    field = np.array(volume.voxels, np.float32, order="C")
    if field.size and (sigma_um > 0 or has_median):
        z, y, x = (gaussian(sigma_um / step) for step in volume.spacing_um)
        smooth_in_place(field, z, y, x, has_median)
    return field


def gaussian(sigma: float) -> NDArray[np.float64]:
    """Return the weights of a Gaussian of sigma voxels, which add up to 1: as SciPy has them."""
    if sigma <= 0:
        return np.ones(1)
    radius = int(SMOOTHING_REACH * sigma + 0.5)
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    return np.asarray(weights / weights.sum(), np.float64)
