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

from stereocell.filters.reach import SMOOTHING_REACH, median_reach
from stereocell.kernels.smoothing import smooth_in_place
from stereocell.model.image_plane import (
    first_of_three,
    in_order,
    slices_back,
    slices_first,
)
from stereocell.model.volume import Volume


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


def gaussian(sigma: float) -> NDArray[np.float64]:
    """Return the weights of a Gaussian, with a sum of 1, as in SciPy. sigma: voxels."""
    if sigma <= 0:
        return np.ones(1)
    radius = int(SMOOTHING_REACH * sigma + 0.5)
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    return np.asarray(weights / weights.sum(), np.float64)
