"""Copy rows and planes by loops.

For an assignment to a slice numba compiles all of its broadcasting and error messages. That takes
1.5 s for each kernel, which is as long as most kernels take in all.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import part


@part
def copy_row(source: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Copy a row (x,) into another of the same length."""
    for x in range(len(out)):
        out[x] = source[x]


@part
def copy_plane(source: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Copy a plane (y, x) into another of the same shape."""
    for y in range(len(out)):
        copy_row(source[y], out[y])
