"""Voxels whose images along one axis are read in another order than the stored one."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.dataset import StoredArray


class OrderedArray:
    """An array whose images along one axis are in another order than stored.

    order  stored index of the image at each index along the axis
    """

    def __init__(self, array: StoredArray, axis: int, order: Sequence[int]) -> None:
        self.shape, self.dtype = tuple(array.shape), array.dtype
        self.chunks = tuple(array.chunks)
        self._array, self._axis, self._order = array, axis, tuple(order)

    def __getitem__(self, key: Any) -> NDArray[Any]:
        """Return the voxels at whole numbers and slices, which count in the new order."""
        part = key[self._axis]
        if not isinstance(part, slice):
            return np.asarray(self._array[self._placed(key, self._order[int(part)])])
        own = [np.asarray(self._array[self._placed(key, n)]) for n in self._order[part]]
        along = sum(isinstance(one, slice) for one in key[: self._axis])
        return np.stack(own, axis=along)

    def _placed(self, key: Any, index: int) -> tuple[Any, ...]:
        return (*key[: self._axis], index, *key[self._axis + 1 :])
