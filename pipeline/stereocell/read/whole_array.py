"""Voxels that are decoded all at once, at the first access, and cached.

A file for each slice, or one stream of gzip, has no blocks. A tile's window is cut along canonical
axes, which cross nearly every slice of nearly every series, so that reading by slices would decode
the whole series for each window. A volume of this kind takes some hundred MB at most, so a process
decodes it once and caches it. Its size is known from the headers and is checked
(read/open_dataset.py) before memory is allocated.
"""

from collections.abc import Callable
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray


class WholeArray:
    """Time points of one volume, (t, z, y, x); one of them is cached.

    shape  (t, z, y, x) in voxels
    load   returns the voxels (z, y, x) of a time point; may return a view
    """

    def __init__(
        self,
        shape: tuple[int, int, int, int],
        dtype: np.dtype[Any],
        load: Callable[[int], NDArray[Any]],
    ) -> None:
        self.shape: tuple[int, ...] = shape
        self.dtype = dtype
        self.chunks: tuple[int, ...] = (1, *shape[1:])
        self._load = load
        self._lock = Lock()
        self._held: tuple[int, NDArray[Any]] | None = None

    def __getitem__(self, key: Any) -> NDArray[Any]:
        """Return voxels by (t, z, y, x): a whole number, then slices or whole numbers."""
        time, *place = key
        with self._lock:
            if self._held is None or self._held[0] != time:
                self._held = None  # frees the old one first: never two in memory
                self._held = (time, self._load(time))
            return self._held[1][tuple(place)]
