"""Number types that builds don't take, read as ones that they do.

Builds take uint8, uint16, int16 and float32. Other types are cast window by window, so that a file
of 8-byte numbers needs no more memory than its window. The stored integers stay at hand for the
rule that tells label maps (objects/label_rule.py).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

TAKEN = ("uint8", "uint16", "int16", "float32")  # by builds
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
    """Return the dtype of a build, in this machine's byte order; None: it takes no such numbers."""
    dtype = np.dtype(stored).newbyteorder("=")
    name = dtype.name if dtype.name in TAKEN else _CAST.get(dtype.name)
    return None if name is None else np.dtype(name)


def cast(voxels: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return voxels of any shape in `dtype`; numbers beyond float32 become infinite."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.ascontiguousarray(voxels, dtype=dtype)
