"""Voxels with reversed axes. Axes are flipped while a window is read."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.dataset import StoredArray


class FlippedArray:
    """An array with some of its axes reversed."""

    def __init__(self, array: StoredArray, flips: Sequence[bool]) -> None:
        self.shape, self.chunks = tuple(array.shape), tuple(array.chunks)
        self.dtype = array.dtype
        self._array, self._flips = array, tuple(flips)

    @property
    def stored(self) -> StoredArray:
        """The array as it is stored."""
        return self._array

    def stored_spans(self, spans: Sequence[Sequence[range]]) -> list[list[range]]:
        """Return ranges of indices along each axis as ranges of indices of the stored array."""
        return [
            [range(n - one.stop, n - one.start) if flip else one for one in ranges]
            for ranges, flip, n in zip(spans, self._flips, self.shape, strict=True)
        ]

    def __getitem__(self, key: Any) -> NDArray[Any]:
        """Return the voxels at whole numbers and slices; slices have step 1 and lie inside."""
        place = [
            _mirrored(part, size) if flip else part
            for part, size, flip in zip(key, self.shape, self._flips, strict=True)
        ]
        found = np.asarray(self._array[tuple(place)])
        kept = [
            flip for part, flip in zip(key, self._flips, strict=True) if isinstance(part, slice)
        ]
        return found[tuple(slice(None, None, -1 if flip else 1) for flip in kept)]


def _mirrored(part: Any, size: int) -> Any:
    if not isinstance(part, slice):
        return size - 1 - int(part)
    start, stop, _ = part.indices(size)
    return slice(size - stop, size - start)
