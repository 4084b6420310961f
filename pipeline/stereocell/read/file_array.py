"""Voxels that lie in one stretch of a file, either unpacked or compressed.

Unpacked voxels are read a window at a time with nibabel's `fileslice`. A memory map would take
address space of the whole file, and would end the process if the file were cut short meanwhile.
Compressed voxels have no blocks: they are unpacked all at once, at the first access, and cached.
"""

import math
import os
from collections.abc import Callable, Sequence
from threading import Lock
from typing import Any, cast

import numpy as np
from nibabel.fileslice import fileslice
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.dataset import StoredArray
from stereocell.read.packed_stream import unpack
from stereocell.read.statements import omission


class FileArray:
    """Unpacked voxels of a file; the last axis is the fastest.

    offset  bytes before the first voxel
    behind  bytes after the last voxel
    """

    def __init__(
        self, path: str, shape: Sequence[int], dtype: np.dtype[Any], offset: int, where: str
    ) -> None:
        self.shape = tuple(shape)
        self.dtype = dtype
        self.chunks: tuple[int, ...] = (*(1 for _ in shape[:-2]), *shape[-2:])
        self._path, self._offset = path, offset
        end, size = offset + math.prod(self.shape) * dtype.itemsize, os.path.getsize(path)
        self.behind = size - end
        if end > size:
            raise SourceError(
                f"{where}: found {size} bytes, expected at least {end} for {self.shape} of "
                f"{dtype.name} (the file is cut short)"
            )

    def __getitem__(self, key: Any) -> NDArray[Any]:
        with open(self._path, "rb") as file:
            found = fileslice(file, key, self.shape, self.dtype, self._offset, "C")  # type: ignore[no-untyped-call]
        return cast("NDArray[Any]", found)


def notes_on_rest(array: StoredArray) -> tuple[str, ...]:
    """Return a note where a file holds more unpacked voxels than its header describes."""
    if not isinstance(array, FileArray):
        return ()
    return rest_note(array.behind, array.shape, array.dtype.itemsize)


def rest_note(behind: int, shape: Sequence[int], item_bytes: int) -> tuple[str, ...]:
    """Return a note on bytes after the voxels if they would fill at least one plane.

    behind      bytes after the voxels
    item_bytes  bytes of one voxel
    """
    voxels = math.prod(shape) * item_bytes
    if behind < voxels // max(shape):
        return ()
    return (
        omission(
            f"{behind:,} bytes behind the voxels, {behind / voxels:.0%} of the voxels' own bytes",
            "the header describes no more voxels",
            "correct its sizes if there are more planes, time points or channels",
        ),
    )


class PackedArray:
    """Voxels that `load` decodes all at once and that are then cached."""

    def __init__(
        self, shape: Sequence[int], dtype: np.dtype[Any], load: Callable[[], NDArray[Any]]
    ) -> None:
        self.shape = tuple(shape)
        self.dtype = dtype
        self.chunks: tuple[int, ...] = self.shape
        self._load = load
        self._lock = Lock()
        self._held: NDArray[Any] | None = None

    def __getitem__(self, key: Any) -> NDArray[Any]:
        with self._lock:
            if self._held is None:
                self._held = self._load()
            return cast("NDArray[Any]", self._held[key])


def unpack_array(
    path: str,
    shape: Sequence[int],
    dtype: np.dtype[Any],
    packing: str,
    offset: int,
    *,
    skip: int = 0,
) -> NDArray[Any]:
    """Return the voxels of the compressed stretch at the end of a file.

    packing  one of packed_stream.PACKINGS
    offset   bytes before the stretch
    skip     unpacked bytes before the first voxel

    Raises OSError for a stretch that is damaged or cut short.
    """
    with open(path, "rb") as file:
        file.seek(offset)
        found = unpack(file, math.prod(shape) * dtype.itemsize, packing, skip=skip)
    return np.frombuffer(found, dtype).reshape(tuple(shape))
