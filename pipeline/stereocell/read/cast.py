"""Convert number types that builds don't accept to types that they do.

Builds accept uint8, uint16, int16 and float32. Other types are converted window by window, so that
a file of 8-byte numbers needs no more memory than one window. The rule that recognises label maps
(objects/label_rule.py) still reads the integers as stored.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

TAKEN = ("uint8", "uint16", "int16", "float32")  # number types that builds accept
_CAST = {
    "bool": "uint8",
    "int8": "int16",
    "float16": "float32",
    "float64": "float32",
    "int32": "float32",
    "uint32": "float32",
    "int64": "float32",
    "uint64": "float32",
}


def built_dtype(stored: Any) -> np.dtype[Any] | None:
    """Return the dtype of a build, in this machine's byte order; None: builds can't take it."""
    dtype = np.dtype(stored).newbyteorder("=")
    name = dtype.name if dtype.name in TAKEN else _CAST.get(dtype.name)
    return None if name is None else np.dtype(name)


def cast(voxels: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return voxels of any shape in `dtype`; numbers beyond its range of floats become infinite."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.ascontiguousarray(voxels, dtype=dtype)
