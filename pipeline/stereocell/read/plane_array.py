"""Voxels read through a library that returns one plane, or a part of one, at a time."""

from collections.abc import Callable, Sequence
from itertools import product
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

# (indices of the plane, rows, columns) -> voxels (rows, columns)
ReadPlane = Callable[[tuple[int, ...], slice, slice], NDArray[Any]]


class PlaneArray:
    """An array whose last two axes are those of a plane. Planes are read singly and not cached."""

    def __init__(self, shape: Sequence[int], dtype: np.dtype[Any], read: ReadPlane) -> None:
        self.shape: tuple[int, ...] = tuple(shape)
        self.dtype = dtype
        self.chunks: tuple[int, ...] = (*(1 for _ in shape[:-2]), *shape[-2:])
        self._read = read
        self._lock = Lock()  # libraries read one plane at a time from an open file

    def __getitem__(self, key: Any) -> NDArray[Any]:
        """Return the voxels at whole numbers and slices; slices have step 1 and lie inside."""
        bounds = [
            part.indices(size)[:2] if isinstance(part, slice) else (int(part), int(part) + 1)
            for part, size in zip(key, self.shape, strict=True)
        ]
        found = np.empty([stop - start for start, stop in bounds], self.dtype)
        rows, columns = (slice(*bound) for bound in bounds[-2:])
        for place in product(*(range(stop - start) for start, stop in bounds[:-2])):
            index = tuple(at + start for at, (start, _) in zip(place, bounds, strict=False))
            with self._lock:
                plane = self._read(index, rows, columns)
            if plane.shape != found[place].shape:
                raise ValueError(
                    f"plane {index}: found {plane.shape} voxels, expected {found[place].shape}"
                )
            found[place] = plane
        return found[tuple(slice(None) if isinstance(part, slice) else 0 for part in key)]
