"""Copies of rows and planes by loops.

For a slice that is assigned, numba compiles all of its broadcasting and that one's messages, which
takes 1.5 s a kernel: as long as most kernels as a whole.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import part


@part
def copy_row(source: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Write a row (x,) into another of its length."""
    for x in range(len(out)):
        out[x] = source[x]


@part
def copy_plane(source: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Write a plane (y, x) into another of its shape."""
    for y in range(len(out)):
        copy_row(source[y], out[y])
