"""Colour spaces."""

import numpy as np
from numpy.typing import NDArray


def to_srgb8(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return 8-bit sRGB of linear colours (IEC 61966-2-1).

    linear  float32, any shape, 0..1; values outside are clipped
    result  uint8, same shape, 0..255
    """
    clipped = np.clip(linear.astype(np.float64), 0, 1)
    bent = 1.055 * clipped ** (1 / 2.4) - 0.055
    return np.round(255 * np.where(clipped <= 0.0031308, 12.92 * clipped, bent)).astype(np.uint8)


def linear_color(rgb: tuple[int, int, int]) -> tuple[float, float, float]:
    """Return linear RGB, 0..1, of sRGB bytes 0..255.

    References: IEC 61966-2-1:1999.
    """
    red, green, blue = (_linear(value / 255.0) for value in rgb)
    return red, green, blue


def _linear(value: float) -> float:
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4
