"""Voxels whose values are inverted, so that dark structures are bright."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.dataset import StoredArray


class InvertedArray:
    """An array whose values are inverted: dark voxels are bright.

    Integers become the dtype's largest value minus the distance from its smallest, such as 255 - v
    for uint8; floats change their sign.
    """

    def __init__(self, array: StoredArray) -> None:
        self.shape, self.chunks = tuple(array.shape), tuple(array.chunks)
        self.dtype = array.dtype
        self.stored = array

    def __getitem__(self, key: Any) -> NDArray[Any]:
        found = np.asarray(self.stored[key])
        return -found if found.dtype.kind == "f" else ~found
