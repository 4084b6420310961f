"""The specimen's size in words, and the scale at which it stands beside everyday things."""

import math

import numpy as np
from numpy.typing import ArrayLike

DISPLAY_M = 1.0  # m; at the display scale the longest edge is at most this long
# um in each unit, and the longest edge, um, that is still described in it
_UNITS = (("um", 1.0, 1e3), ("mm", 1e3, 1e6), ("m", 1e6, math.inf))


def display_scale(longest_um: float) -> float:
    """Return the largest power of ten, from 1 on, that leaves the longest edge within DISPLAY_M.

    A round number keeps lengths readable: at 10000, a metre of the scene is 100 um.
    """
    if longest_um <= 0:
        return 1.0
    # the small number keeps an edge of 100 um from being a little longer by rounding
    return 10.0 ** max(math.floor(math.log10(DISPLAY_M / (longest_um * 1e-6)) + 1e-9), 0)


def describe_size(edges_um: ArrayLike) -> str:
    """Return the lengths of a box's edges (x, y, z), um, as `120 x 48 x 12 um`."""
    edges = np.asarray(edges_um, np.float64)
    name, unit_um, _ = next(one for one in _UNITS if edges.max() < one[2])
    return f"{' x '.join(f'{edge / unit_um:.3g}' for edge in edges)} {name}"
