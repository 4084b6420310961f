"""Filters applied before a surface is extracted: hot voxels are removed and noise is smoothed.

A median of 3 x 3 voxels removes sheets of two voxels that lie across its plane, and a Gaussian of
one voxel removes sheets of one and a half. So neither may move a value farther than noise explains.
Even parts become nearly as smooth as without this bound. A wall of half a voxel stays if it stands
out of the noise.

With the bound alone, hot voxels would stay as well. So the bound counts from a clipped value: each
voxel is first clipped to the range of 24 of its 3 x 3 x 3 neighbours. The two neighbours straight
across the plane of the images do not count, because a camera's hot pixel is hot in all planes.
Lines of one voxel pass this clip, and a single hot voxel does not. Two hot voxels side by side are
left to the removal of fragments. An earlier clip to the second largest value in the plane removed
them, but also a third of the thin bone in a CT scan with voxels of 3 mm.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.smoothing import smooth_in_place
from stereocell.model.image_plane import (
    MAX_RATIO,
    back_of_three,
    first_of_three,
    in_order,
    slices_back,
    slices_first,
)
from stereocell.model.spacing import Spacing
from stereocell.model.volume import Volume

# Voxels to each side; the clip of hot voxels looks at neighbours within this distance
HOT_VOXEL_REACH = 1
MEDIAN_REACH = 1  # voxels to each side in the plane of the images that the median uses
SMOOTHING_REACH = 4.0  # radius of the Gaussian, in sigmas


def denoise(volume: Volume, sigma_um: float, max_shift: float | None = None) -> NDArray[np.float32]:
    """Return the voxels after a 3 x 3 median within each image slice, and a 3D Gaussian.

    The median removes hot voxels, which a Gaussian would spread. It is left out if the voxel
    spacings along the two axes of a slice differ too much.

    sigma_um   sigma of the Gaussian; 0 turns it off
    max_shift  largest change of a value by both filters, voxel values; None: no limit
    result     float32 (z, y, x), voxel values

    >>> noise = np.random.default_rng(0).normal(100, 40, (16, 32, 32))
    >>> smoothed = denoise(Volume(noise, (2.0, 1.0, 1.0)), sigma_um=1.0)
    >>> round(float(smoothed.mean()), -1), bool(smoothed.std() < 0.3 * noise.std())
    (100.0, True)
    """
    return in_order(slices_back(denoise_slices(volume, sigma_um, max_shift), volume.slice_axis))


def denoise_slices(
    volume: Volume, sigma_um: float, max_shift: float | None = None
) -> NDArray[np.float32]:
    """Return the result of `denoise` with the axes (slice, row, column)."""
    return _filtered(volume, sigma_um, True, max_shift)


def smooth(volume: Volume, sigma_um: float) -> NDArray[np.float32]:
    """Return the voxels after a Gaussian of sigma `sigma_um` (0: none); float32 (z, y, x)."""
    return in_order(slices_back(_filtered(volume, sigma_um, False, None), volume.slice_axis))


def _filtered(
    volume: Volume, sigma_um: float, has_median: bool, max_shift: float | None
) -> NDArray[np.float32]:
    """Return the filtered voxels, float32 (slice, row, column)."""
    axis = volume.slice_axis
    field = in_order(slices_first(volume.voxels, axis), np.float32)
    if np.may_share_memory(field, volume.voxels):  # the volume is not changed
        field = field.copy()
    has_median = has_median and any(median_reach(volume.spacing_um, axis))
    if field.size and (sigma_um > 0 or has_median):
        steps = first_of_three(volume.spacing_um, axis)
        across, rows, columns = (gaussian(sigma_um / step) for step in steps)
        bound = np.float32(np.inf if max_shift is None else max_shift)
        smooth_in_place(field, across, rows, columns, has_median, bound)
    return field


def median_reach(spacing_um: Spacing, slice_axis: int) -> tuple[int, int, int]:
    """Return how many voxels (z, y, x) the median reaches to each side; 0, 0, 0: no median."""
    _, row, column = first_of_three(spacing_um, slice_axis)
    reach = MEDIAN_REACH if max(row, column) <= MAX_RATIO * min(row, column) else 0
    return back_of_three((0, reach, reach), slice_axis)


def median_size(spacing_um: Spacing, slice_axis: int) -> tuple[int, int, int]:
    """Return the size (z, y, x) of the median in voxels; 1, 1, 1: no median."""
    z, y, x = (2 * reach + 1 for reach in median_reach(spacing_um, slice_axis))
    return z, y, x


def gaussian(sigma: float) -> NDArray[np.float64]:
    """Return the weights of a Gaussian, with a sum of 1, as in SciPy. sigma: voxels."""
    if sigma <= 0:
        return np.ones(1)
    radius = int(SMOOTHING_REACH * sigma + 0.5)
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    return np.asarray(weights / weights.sum(), np.float64)
