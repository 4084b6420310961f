"""Choose the dtype for rescaled values, and rescale them.

Integers stay integers: if slopes and intercepts are whole, the dtype is the narrowest of uint8,
uint16 and int16 that holds all values of the stored bits. Otherwise it is float32.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

_INTEGERS = (np.uint8, np.uint16, np.int16)  # narrowest first


def dtype_for(ranges: Iterable[tuple[float, float, float, float]]) -> np.dtype[Any]:
    """Return a dtype that holds the values of all slices.

    ranges  (lowest stored value, highest stored value, slope, intercept) of each slice
    """
    ends: list[float] = []
    for low, high, slope, intercept in ranges:
        if not (slope.is_integer() and intercept.is_integer()):
            return np.dtype(np.float32)
        ends += [slope * low + intercept, slope * high + intercept]
    for kind in _INTEGERS:
        limits = np.iinfo(kind)
        if ends and limits.min <= min(ends) and max(ends) <= limits.max:
            return np.dtype(kind)
    return np.dtype(np.float32)


def rescale(
    stored: NDArray[Any], slope: float, intercept: float, dtype: np.dtype[Any]
) -> NDArray[Any]:
    """Return slope * stored + intercept in `dtype`, computed without integer overflow.

    stored  any shape and dtype; the result has the same shape

    Values beyond float32 become infinite; the caller checks for them.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        if slope == 1 and intercept == 0:
            return stored.astype(dtype, copy=False)
        if dtype.kind == "f":
            return (stored.astype(np.float64) * slope + intercept).astype(dtype)
    return (stored.astype(np.int64) * int(slope) + int(intercept)).astype(dtype)
