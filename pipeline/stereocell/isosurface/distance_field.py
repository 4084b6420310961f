"""The distance field of an iso-surface: how far each voxel is from it, to first order."""

import numpy as np
from numpy.typing import NDArray

_PLANES = 4  # at once


def gradient_magnitude(
    field: NDArray[np.float32], spacing_um: tuple[float, float, float]
) -> NDArray[np.float32]:
    """Return |grad f| per um (central differences, one-sided at the ends), float32 (z, y, x).

    A voxel's result depends on nothing but its neighbours, bit by bit: fields whose squares leave
    float32 are scaled by a power of two, which changes no digit. In these a slope below 1e-18 of
    the field's largest value is lost, and a slope itself has to fit into float32.
    """
    peak = max(abs(float(field.max())), abs(float(field.min())))
    usual = peak == 0 or 1e-9 < peak < 1e12
    exponent = 0 if usual else int(np.clip(-np.frexp(peak)[1], -126, 126))
    scale = np.float32(2.0**exponent)
    if not usual:
        field = field * scale
    magnitude = np.empty_like(field)
    for first in range(0, len(field), _PLANES):  # np.gradient takes four times what it is given
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
    """Return the first-order distance to the surface f = iso in um, positive inside.

    It is (f - iso) / |grad f|, true to a fraction of a voxel near the surface, and clipped to two
    of the coarsest spacings, beyond which it means nothing. `iso_value` broadcasts over the field;
    `value_range` (dataset-wide, voxel values) bounds the division where the field is flat.
    """
    slope = gradient_magnitude(field, spacing_um)
    slope += np.float32(1e-6 * value_range)
    distance = np.subtract(field, iso_value, dtype=np.float32)
    distance /= slope
    limit = np.float32(2 * max(spacing_um))
    return np.clip(distance, -limit, limit, out=distance)
