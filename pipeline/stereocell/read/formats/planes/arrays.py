"""Voxels of a folder of files as lazy arrays: one plane, or a window of one file, at a time."""

from collections import OrderedDict
from collections.abc import Callable
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.tiling import Box
from stereocell.read.image import Image

_OPEN_FILES = 8  # stacks that are kept open at a time
_Index = tuple[int, int]  # time, channel


class PlaneArray:
    """Files of one plane each, (t, c, z, y, x). Samples of colour pixels are the channels.

    shape    (t, c, z, y, x) in voxels
    load     returns the pixels (rows, columns, samples) of the file at (t, c, z)
    samples  True: c counts the samples of each file
    """

    def __init__(
        self,
        shape: tuple[int, int, int, int, int],
        dtype: np.dtype[Any],
        load: Callable[[int, int, int], NDArray[Any]],
        samples: bool,
    ) -> None:
        self.shape: tuple[int, ...] = shape
        self.dtype = dtype
        self.chunks: tuple[int, ...] = (1, 1, 1, *shape[3:])
        self._load, self._samples = load, samples

    def __getitem__(self, key: Any) -> NDArray[Any]:
        """Return voxels by (t, c, z, y, x): two whole numbers, then slices."""
        time, channel, planes, rows, columns = key
        file, sample = (0, channel) if self._samples else (channel, 0)
        numbers = range(*planes.indices(self.shape[2]))
        return np.stack(
            [self._load(time, file, number)[rows, columns, sample] for number in numbers]
        )


class StackArray:
    """Files that are each a stack of planes, together as one array (t, c, z, y, x).

    shape  (t, c, z, y, x) of all files together, in voxels
    dtype  dtype that holds the values of all files
    open_  returns the image of the file at (t, c)
    inner  True: the file of a time point holds all channels, and `open_` is called with c = 0
    """

    def __init__(
        self,
        shape: tuple[int, int, int, int, int],
        dtype: np.dtype[Any],
        chunk: tuple[int, int, int],
        open_: Callable[[int, int], Image],
        inner: bool,
    ) -> None:
        self.shape: tuple[int, ...] = shape
        self.dtype = dtype
        self.chunks: tuple[int, ...] = (1, 1, *chunk)
        self._open, self._inner = open_, inner
        self._images: OrderedDict[_Index, Image] = OrderedDict()
        self._lock = Lock()

    def __getitem__(self, key: Any) -> NDArray[Any]:
        """Return voxels by (t, c, z, y, x): two whole numbers, then slices."""
        time, channel, *place = key
        bounds = [part.indices(n)[:2] for part, n in zip(place, self.shape[2:], strict=True)]
        (z0, z1), (y0, y1), (x0, x1) = bounds
        box = Box((z0, y0, x0), (z1, y1, x1))
        file, inside = (0, channel) if self._inner else (channel, 0)
        with self._lock:
            image = self._image((time, file))
            window = image.arrays[0].stored_window(0, inside, box)
        return window.astype(self.dtype, copy=False)

    def _image(self, index: _Index) -> Image:
        if index in self._images:
            self._images.move_to_end(index)
            return self._images[index]
        self._images[index] = self._open(*index)
        if len(self._images) > _OPEN_FILES:
            _close(self._images.popitem(last=False)[1])
        return self._images[index]

    def close(self) -> None:
        """Close the files."""
        with self._lock:
            for image in self._images.values():
                _close(image)
            self._images.clear()


def _close(image: Image) -> None:
    if image.close is not None:
        image.close()
