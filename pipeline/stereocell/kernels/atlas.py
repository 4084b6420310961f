"""Cut a slice atlas of half floats into slices of bytes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel


@kernel
def cut_slices(halves: NDArray[Any], table: NDArray[np.uint8], slices: NDArray[np.uint8]) -> None:
    """Fill slices from an atlas.

    halves  uint16 (rows * height, columns * width), bits of half floats
    table   (65536,), the byte of each half float
    slices  (depth, height, width), slice 0 at the upper left of the atlas
    """
    depth, height, width = slices.shape
    columns = halves.shape[1] // width
    for z in range(depth):
        top, left = z // columns * height, z % columns * width
        for y in range(height):
            for x in range(width):
                slices[z, y, x] = table[halves[top + y, left + x]]
