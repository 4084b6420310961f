"""The distance field of an iso-surface: each voxel's distance to it, to first order."""

import numpy as np
from numpy.typing import NDArray

_PLANES = 4  # planes computed at once


def gradient_magnitude(
    field: NDArray[np.float32], spacing_um: tuple[float, float, float]
) -> NDArray[np.float32]:
    """Return |grad f| by central differences, one-sided at the ends.

    field       float32 (z, y, x), voxel values
    spacing_um  (z, y, x)
    result      float32 (z, y, x), voxel values per um

    A result depends on the voxel's neighbours alone, bit by bit: a field whose squares overflow
    float32 is scaled by a power of two, which changes no digit. In such a field slopes below 1e-18
    of its largest value are lost, and each slope must fit into float32.
    """
    peak = max(abs(float(field.max())), abs(float(field.min())))
    usual = peak == 0 or 1e-9 < peak < 1e12
    exponent = 0 if usual else int(np.clip(-np.frexp(peak)[1], -126, 126))
    scale = np.float32(2.0**exponent)
    if not usual:
        field = field * scale
    magnitude = np.empty_like(field)
    for first in range(0, len(field), _PLANES):  # np.gradient takes four times its input's memory
        low = max(first - 1, 0)
        squares = _squared_gradient(field[low : first + _PLANES + 1], spacing_um)
        own = magnitude[first : first + _PLANES]
        np.sqrt(squares[first - low :][: len(own)], out=own)
    return magnitude if usual else np.divide(magnitude, scale, out=magnitude)


def _squared_gradient(
    field: NDArray[np.float32], spacing_um: tuple[float, float, float]
) -> NDArray[np.float32]:
    squares = np.zeros_like(field)
    for axis, step in enumerate(spacing_um):
        if field.shape[axis] > 1:
            slope = np.gradient(field, np.float32(step), axis=axis)
            squares += np.square(slope, out=slope)
    return squares


def signed_distance(
    field: NDArray[np.float32],
    iso_value: NDArray[np.float32],
    *,
    spacing_um: tuple[float, float, float],
    value_range: float,
) -> NDArray[np.float32]:
    """Return the first-order distance to the surface f = iso, positive inside.

    field        float32 (z, y, x), voxel values
    iso_value    float32, voxel values; broadcasts over the field
    spacing_um   (z, y, x)
    value_range  dataset-wide, voxel values; bounds the division where the field is flat
    result       float32 (z, y, x), um

    The distance is (f - iso) / |grad f|. It is exact to a fraction of a voxel near the surface, and
    clipped to two of the coarsest spacings: farther away it means nothing.

    >>> ramp = np.linspace(0, 8, 9, dtype=np.float32)[None, None] * np.ones((3, 3, 1), np.float32)
    >>> signed_distance(ramp, np.float32(3.5), spacing_um=(1, 1, 1), value_range=8)[1, 1].round(2)
    array([-2. , -2. , -1.5, -0.5,  0.5,  1.5,  2. ,  2. ,  2. ],
          dtype=float32)
    """
    slope = gradient_magnitude(field, spacing_um)
    slope += np.float32(1e-6 * value_range)
    distance = np.subtract(field, iso_value, dtype=np.float32)
    distance /= slope
    limit = np.float32(2 * max(spacing_um))
    return np.clip(distance, -limit, limit, out=distance)
