"""Convert between colour spaces: linear RGB, sRGB and CIELab."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

_D50 = np.array([0.9642, 1.0, 0.8249])  # XYZ of white under D50
_RGB_OF_D50 = np.array(  # matrix for column vectors: from XYZ under D50 to linear sRGB
    [
        [3.1338561, -1.6168667, -0.4906146],
        [-0.9787684, 1.9161415, 0.0334540],
        [0.0719453, -0.2289914, 1.4052427],
    ]
)


def to_srgb8(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return 8-bit sRGB of linear colours (IEC 61966-2-1).

    linear  float32, any shape, 0..1; values outside are clipped
    result  uint8, same shape, 0..255
    """
    # A table by the upper half of a float32's bits takes a fifth of the time of a power. An entry
    # is a byte, and a value is compared once with the least value that has the next byte.
    first, least = _srgb_table()
    clipped = np.clip(np.asarray(linear, np.float32), 0, 1)
    found = first[clipped.view(np.uint32) >> 16]
    found += clipped >= least[found]
    return found


@cache
def _srgb_table() -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return the byte of the least float32 with each upper half of its bits, 0 for values above 1.

    The second array (256,) has the least float32 that becomes a larger byte; infinity for 255.
    """
    low, high = np.zeros(255, np.uint32), np.full(255, np.float32(1).view(np.uint32))
    while (high - low > 1).any():  # the bits of positive floats rise with their values
        middle = (low + high) // 2
        is_larger = _bend(middle.view(np.float32)) > np.arange(255)
        low, high = np.where(is_larger, low, middle), np.where(is_larger, middle, high)
    least = np.append(high.view(np.float32), np.float32(np.inf))
    starts = np.arange(1 << 16, dtype=np.uint32) << 16
    first = np.searchsorted(least, starts.view(np.float32), "right").astype(np.uint8)
    first[starts > np.float32(1).view(np.uint32)] = 0
    return first, least


def _bend(linear: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return sRGB of linear light 0..1, rounded to whole numbers 0..255."""
    exact = linear.astype(np.float64)
    bent = 1.055 * exact ** (1 / 2.4) - 0.055
    return np.asarray(np.round(255 * np.where(exact <= 0.0031308, 12.92 * exact, bent)))


def linear_color(rgb: tuple[int, int, int]) -> tuple[float, float, float]:
    """Return linear RGB, 0..1, of sRGB bytes, 0..255 (IEC 61966-2-1:1999).

    >>> linear_color((255, 0, 0))
    (1.0, 0.0, 0.0)
    """
    red, green, blue = (_linear(value / 255.0) for value in rgb)
    return red, green, blue


def _linear(value: float) -> float:
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def linear_color_of_lab(lab: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return linear RGB, 0..1, of a CIELab colour under D50. Colours outside of sRGB are clipped.

    References: CIE 15; IEC 61966-2-1:1999; adaptation from D50 to D65 by Bradford's matrix.
    """
    middle = (lab[0] + 16) / 116
    bent = np.array([middle + lab[1] / 500, middle, middle - lab[2] / 200])
    xyz = _D50 * np.where(bent > 6 / 29, bent**3, (bent - 4 / 29) * 3 * (6 / 29) ** 2)
    red, green, blue = np.clip(_RGB_OF_D50 @ xyz, 0, 1).tolist()
    return red, green, blue


def lab_of_linear(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return CIELab under D50, float64 (n, 3), of linear RGB (n, 3), 0..1."""
    share = linear @ np.linalg.inv(_RGB_OF_D50).T / _D50
    bent = np.where(share > (6 / 29) ** 3, np.cbrt(share), share / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = bent.T
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)
