"""Describe the specimen's size, and choose the scale at which it is displayed in a room."""

import math

import numpy as np
from numpy.typing import ArrayLike

DISPLAY_M = 1.0  # m; longest edge at the display scale
# Each unit, um per unit, and the longest edge in um that is described in this unit.
_UNITS = (("um", 1.0, 1e3), ("mm", 1e3, 1e6), ("m", 1e6, math.inf))


def display_scale(longest_um: float) -> float:
    """Return the largest power of ten, at least 1, that keeps the longest edge within DISPLAY_M.

    A round number keeps lengths readable: at 10000, a metre of the scene is 100 um.

    >>> display_scale(100.0)
    10000.0
    """
    if longest_um <= 0:
        return 1.0
    # 1e-9 absorbs rounding, so that an edge of exactly 100 um still fits
    return 10.0 ** max(math.floor(math.log10(DISPLAY_M / (longest_um * 1e-6)) + 1e-9), 0)


def describe_size(edges_um: ArrayLike) -> str:
    """Return the lengths of a box's edges (x, y, z), um, as text.

    >>> describe_size((120, 48, 12))
    '120 x 48 x 12 um'
    """
    edges = np.asarray(edges_um, np.float64)
    name, unit_um, _ = next(one for one in _UNITS if edges.max() < one[2])
    return f"{' x '.join(f'{edge / unit_um:.3g}' for edge in edges)} {name}"
