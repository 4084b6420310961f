"""Integers of 8 and 16 bits as codes: indices of tables that have an entry for each value."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.value_counts import count_codes

_AT_ONCE = 1 << 16  # voxels that are counted together; their codes fit into a processor's cache


def has_codes(dtype: np.dtype[Any]) -> bool:
    """Return whether values of a type are integers of at most 16 bits, in this machine's order."""
    return dtype in (np.uint8, np.int8, np.uint16, np.int16)


def codes_of(values: NDArray[Any]) -> NDArray[np.uint16]:
    """Return the code of each value, uint16 (n,): its bits as an unsigned integer."""
    plain = np.ascontiguousarray(values).reshape(-1)
    return plain.view(f"u{values.dtype.itemsize}").astype(np.uint16)


def every_code(dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return the value of each code, in the type: 256 or 65536 values."""
    unsigned = np.dtype(f"u{dtype.itemsize}")
    return np.arange(1 << 8 * dtype.itemsize, dtype=np.uint32).astype(unsigned).view(dtype)


def count_each(values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.int64]]:
    """Return the values that occur, rising, and how many times each occurs.

    values  any shape, of a type that `has_codes`

    >>> distinct, times = count_each(np.array([3, -1, 3], np.int16))
    >>> distinct.tolist(), times.tolist()
    ([-1, 3], [1, 2])
    """
    flat, counts = values.ravel("K"), np.zeros(1 << 16, np.int64)  # a turned array is not copied
    for start in range(0, flat.size, _AT_ONCE):
        count_codes(codes_of(flat[start : start + _AT_ONCE]), counts)
    held = np.flatnonzero(counts)
    distinct = every_code(values.dtype)[held]
    order = np.argsort(distinct)
    return distinct[order], counts[held][order]
