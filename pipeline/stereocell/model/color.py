"""Convert between colour spaces: linear RGB, sRGB and CIELab."""

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
    clipped = np.clip(linear.astype(np.float64), 0, 1)
    bent = 1.055 * clipped ** (1 / 2.4) - 0.055
    return np.round(255 * np.where(clipped <= 0.0031308, 12.92 * clipped, bent)).astype(np.uint8)


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
