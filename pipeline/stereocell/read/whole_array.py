"""Voxels that are decoded all at once, at the first access, and cached.

Formats with one file per slice, or one gzip stream, have no blocks. A tile's window is cut along
canonical axes, which cross nearly every slice of nearly every series. Reading slice by slice would
therefore decode the whole series for each window. Such a volume takes a few hundred MB at most, so
a process decodes it once and caches it. Its size is known from the headers and is checked
(read/open_dataset.py) before memory is allocated.
"""

from collections.abc import Callable
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.image_plane import in_order


class WholeArray:
    """Time points of one volume, (t, z, y, x); the last one that was read is cached.

    shape  (t, z, y, x) in voxels
    load   returns the voxels (z, y, x) of a time point; they may be a turned view of a larger array
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
        """Return voxels by (t, z, y, x): a whole number, then slices or whole numbers.

        A window of a turned view is copied, in an order in which later passes over it are fast.
        """
        time, *place = key
        with self._lock:
            if self._held is None or self._held[0] != time:
                self._held = None  # frees the old time point first, so that memory never holds two
                self._held = (time, self._load(time))
            found = self._held[1][tuple(place)]
        return in_order(found) if found.ndim == 3 else found
