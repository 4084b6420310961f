"""Check that the index of a chunked HDF5 dataset leads to each of its chunks.

Most files have an index of version 1, a B-tree without a checksum. HDF5 reads a chunk that its
look-up does not find as the fill value, and a chunk at a wrong address as other bytes. So the
positions, addresses and sizes in the index are compared with the dataset's shape, the file's size
and each other. Each chunk that the index lists is looked up.

Listing the index takes about 2 us per chunk and is done once. A look-up takes 5.5 us, so each chunk
is looked up when a window first touches it; reading it takes longer than that.
"""

import math
from array import array
from collections.abc import Sequence
from typing import Any, NoReturn

import h5py
import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError

# chunks; a longer index is not checked, since its list takes about 100 bytes per chunk
_MOST_CHUNKS = 10_000_000
_MOST_PLACES = 1 << 63  # positions for chunks; 64-bit numbers can't count more


class ChunkIndex:
    """The chunks that the index of a dataset lists.

    Raises SourceError where the index contradicts itself, the shape or the file. Datasets without
    chunks and indexes of more than 10 million chunks are not checked.
    """

    def __init__(self, dataset: h5py.Dataset, where: str) -> None:
        self._dataset, self._where = dataset, where
        # numbers of the positions of the listed chunks, in rising order
        self._numbers = np.empty(0, np.int64)
        if dataset.chunks is None or dataset.id.get_num_chunks() > _MOST_CHUNKS:
            return
        pairs = zip(dataset.shape, dataset.chunks, strict=True)
        self._grid = tuple(-(-n // size) for n, size in pairs)
        if 0 < math.prod(self._grid) < _MOST_PLACES:
            self._list()
        self._is_found = np.zeros(len(self._numbers), bool)

    def require_found(self, window: Sequence[slice | int] | None = None) -> None:
        """Look up the chunks that a window touches, each only once; None: all chunks.

        Raises SourceError where HDF5 doesn't find a chunk that the index lists.
        """
        if not len(self._numbers):
            return
        which = np.arange(len(self._numbers)) if window is None else self._touched(window)
        which = which[~self._is_found[which]]
        places = np.stack(np.unravel_index(self._numbers[which], self._grid), axis=1)
        for place in map(tuple, (places * self._dataset.chunks).tolist()):
            if not _is_found(self._dataset, place):
                self._refuse(place, "an entry that no look-up finds", "one that leads to the chunk")
        self._is_found[which] = True

    def _touched(self, window: Sequence[slice | int]) -> NDArray[Any]:
        """Return the indices in the list of the chunks that a window touches."""
        spans = []
        for part, n, size in zip(window, self._dataset.shape, self._dataset.chunks, strict=True):
            start, stop, _ = (part if isinstance(part, slice) else slice(part, part + 1)).indices(n)
            spans.append(np.arange(start // size, -(-stop // size)))
        wanted = np.ravel_multi_index(np.meshgrid(*spans, indexing="ij"), self._grid).ravel()
        at = np.searchsorted(self._numbers, wanted).clip(max=len(self._numbers) - 1)
        return np.asarray(at[self._numbers[at] == wanted])

    def _list(self) -> None:
        """List the chunks of the index, and compare the entries."""
        rank = len(self._dataset.chunks)
        listed = array("Q")

        def add(entry: Any) -> None:
            if entry.byte_offset is not None:
                listed.extend(
                    (*entry.chunk_offset, entry.byte_offset, entry.size, entry.filter_mask)
                )

        self._dataset.id.chunk_iter(add)
        rows = np.frombuffer(listed, np.uint64).reshape(-1, rank + 3)
        places, (starts, sizes, skipped) = rows[:, :rank], rows[:, rank:].T
        is_placed = _is_placed(self._dataset, places)
        chunks = np.array(self._dataset.chunks, np.uint64)
        inside = np.where(is_placed[:, None], places // chunks, 0).astype(np.int64)
        numbers = np.ravel_multi_index(tuple(inside.T), self._grid)
        end = int(self._dataset.file.id.get_filesize())
        checks = (
            (is_placed, "a position off the grid", "a position of the grid"),
            (_is_first(numbers), "that position twice", "each position once"),
            (_is_apart(starts, sizes, end), _SHARED, "bytes of its own"),
            (_has_size(self._dataset, skipped, sizes), _OTHER_SIZE, "the size of its voxels"),
        )
        for is_sound, found, expected in checks:
            if not is_sound.all():
                self._refuse(places[np.argmin(is_sound)], found, expected)
        self._numbers = np.sort(numbers)

    def _refuse(self, place: Sequence[Any], found: str, expected: str) -> NoReturn:
        raise SourceError(
            f"{self._where}: index of chunks: {tuple(int(n) for n in place)}: found {found}, "
            f"expected {expected}: the file is damaged: copy it again"
        )


_SHARED = "bytes beyond the end of the file or of another chunk"
_OTHER_SIZE = "an unpacked chunk of another size"


def _is_placed(dataset: h5py.Dataset, places: NDArray[Any]) -> NDArray[np.bool_]:
    is_inside = (places < np.array(dataset.shape, np.uint64)).all(axis=1)
    is_aligned = (places % np.array(dataset.chunks, np.uint64) == 0).all(axis=1)
    return np.asarray(is_inside & is_aligned)


def _is_first(numbers: NDArray[Any]) -> NDArray[np.bool_]:
    _, first = np.unique(numbers, return_index=True)
    is_first = np.zeros(len(numbers), bool)
    is_first[first] = True
    return is_first


def _is_apart(starts: NDArray[Any], sizes: NDArray[Any], end: int) -> NDArray[np.bool_]:
    order = np.argsort(starts, kind="stable")
    following = np.append(starts[order][1:], np.uint64(end))
    is_apart = np.empty(len(starts), bool)
    is_apart[order] = (starts[order] <= following) & (sizes[order] <= following - starts[order])
    return is_apart


def _has_size(
    dataset: h5py.Dataset, skipped: NDArray[Any], sizes: NDArray[Any]
) -> NDArray[np.bool_]:
    """Return whether each chunk that no filter compresses has the size of its voxels.

    skipped  masks of the entries: a bit for each filter that was skipped for the chunk
    """
    filters = dataset.id.get_create_plist().get_nfilters()
    every = np.uint64((1 << filters) - 1)
    unpacked = math.prod(dataset.chunks) * dataset.id.get_type().get_size()
    return np.asarray((skipped <= every) & ((skipped != every) | (sizes == unpacked)))


def _is_found(dataset: h5py.Dataset, place: tuple[int, ...]) -> bool:
    """Return whether HDF5 finds a chunk by its position. The buffer is too small to read it."""
    try:
        dataset.id.read_direct_chunk(place, out=bytearray(1))
    except ValueError:  # the buffer is too small, so the look-up has found the chunk's size
        return True
    except (RuntimeError, OSError):
        return False
    return True
