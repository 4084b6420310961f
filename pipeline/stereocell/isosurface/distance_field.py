"""The distance field of an iso-surface: the first-order distance of each voxel to the surface."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.gradients import divide_by_slopes, measure_slopes
from stereocell.model.spacing import Spacing


def gradient_magnitude(field: NDArray[np.float32], spacing_um: Spacing) -> NDArray[np.float32]:
    """Return |grad f| by central differences, one-sided at the ends.

    field       float32 (z, y, x), voxel values
    spacing_um  (z, y, x)
    result      float32 (z, y, x), voxel values per um

    Each result depends on the voxel's neighbours alone, and is the same bit by bit in every tile.
    """
    return measure_slopes(np.ascontiguousarray(field), np.array(spacing_um, np.float64))


def signed_distance(
    field: NDArray[np.float32],
    iso_value: NDArray[np.float32],
    *,
    spacing_um: Spacing,
    value_range: float,
) -> NDArray[np.float32]:
    """Return the first-order distance to the surface f = iso, positive inside.

    field        float32 (z, y, x), voxel values
    iso_value    float32, voxel values; broadcasts over the field
    spacing_um   (z, y, x)
    value_range  dataset-wide, voxel values; bounds the division where the field is flat
    result       float32 (z, y, x), um

    The distance is (f - iso) / |grad f|. It is exact to a fraction of a voxel near the surface. It
    is clipped to two of the coarsest spacings, because it is not reliable farther away.

    >>> ramp = np.linspace(0, 8, 9, dtype=np.float32)[None, None] * np.ones((3, 3, 1), np.float32)
    >>> signed_distance(ramp, np.float32(3.5), spacing_um=(1, 1, 1), value_range=8)[1, 1].round(2)
    array([-2. , -2. , -1.5, -0.5,  0.5,  1.5,  2. ,  2. ,  2. ],
          dtype=float32)
    """
    above = np.subtract(field, iso_value, dtype=np.float32)
    to_distance(above, spacing_um=spacing_um, value_range=value_range)
    return above


def to_distance(above: NDArray[np.float32], *, spacing_um: Spacing, value_range: float) -> None:
    """Replace a field less its iso-value by the distance, in place: see `signed_distance`.

    above        float32 (z, y, x), voxel values less the iso-value; afterwards um
    spacing_um   (z, y, x)
    value_range  dataset-wide, voxel values
    """
    steps = np.array(spacing_um, np.float64)
    divide_by_slopes(above, steps, 1e-6 * value_range, 2.0 * max(spacing_um))
