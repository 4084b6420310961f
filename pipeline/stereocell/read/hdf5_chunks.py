"""Whether the index of a chunked HDF5 dataset leads to each of its chunks.

Most files have an index of version 1, a B-tree without a checksum. HDF5 reads a chunk that its
look-up does not find as the fill value, and one at a wrong address as other bytes. So the places,
addresses and sizes in the index are compared with the dataset's shape, the file's size and each
other, and each chunk that the index lists is looked up.
"""

import math
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError

_MOST_CHUNKS = 30_000  # most that are compared: a look-up takes 5.5 us, so this takes 0.2 s


def require_sound_index(dataset: h5py.Dataset, where: str) -> None:
    """Raise SourceError where the index of a dataset contradicts itself, the shape or the file.

    An index of more than 30 000 chunks is not looked at.
    """
    if dataset.chunks is None or not _MOST_CHUNKS >= _number(dataset) > 0:
        return
    listed: list[Any] = []
    dataset.id.chunk_iter(listed.append)
    listed = [one for one in listed if one.byte_offset is not None]
    if not listed:
        return
    places = np.array([one.chunk_offset for one in listed], np.uint64)
    starts = np.array([one.byte_offset for one in listed], np.uint64)
    sizes = np.array([one.size for one in listed], np.uint64)
    checks = (
        (_has_place(dataset, places), "that place twice or off the grid", "each place once"),
        (
            _is_apart(starts, sizes, int(dataset.file.id.get_filesize())),
            "bytes beyond the file or of another chunk",
            "bytes of its own",
        ),
        (
            _has_size(dataset, listed, sizes),
            "an unpacked chunk of another size",
            "the size of its voxels",
        ),
        (
            np.array([_is_found(dataset, one.chunk_offset) for one in listed]),
            "an entry that no look-up finds",
            "one that leads to the chunk",
        ),
    )
    for is_sound, found, expected in checks:
        if not is_sound.all():
            place = tuple(int(n) for n in places[np.argmin(is_sound)])
            raise SourceError(
                f"{where}: index of chunks: {place}: found {found}, expected {expected}: the file "
                "is damaged: copy it again"
            )


def _number(dataset: h5py.Dataset) -> int:
    """Return how many chunks the shape takes."""
    return math.prod(-(-n // size) for n, size in zip(dataset.shape, dataset.chunks, strict=True))


def _has_place(dataset: h5py.Dataset, places: NDArray[Any]) -> NDArray[np.bool_]:
    _, first = np.unique(places, axis=0, return_index=True)
    is_first = np.zeros(len(places), bool)
    is_first[first] = True
    is_inside = (places < np.array(dataset.shape, np.uint64)).all(axis=1)
    is_aligned = (places % np.array(dataset.chunks, np.uint64) == 0).all(axis=1)
    return np.asarray(is_first & is_inside & is_aligned)


def _is_apart(starts: NDArray[Any], sizes: NDArray[Any], end: int) -> NDArray[np.bool_]:
    order = np.argsort(starts, kind="stable")
    following = np.append(starts[order][1:], np.uint64(end))
    is_apart = np.empty(len(starts), bool)
    is_apart[order] = (starts[order] <= following) & (sizes[order] <= following - starts[order])
    return is_apart


def _has_size(dataset: h5py.Dataset, listed: list[Any], sizes: NDArray[Any]) -> NDArray[np.bool_]:
    """Whether chunks that no filter packs have the size of their voxels.

    The mask of an entry has a bit for each filter that did not pack the chunk.
    """
    skipped = np.array([one.filter_mask for one in listed], np.uint64)
    filters = dataset.id.get_create_plist().get_nfilters()
    every = np.uint64((1 << filters) - 1)
    unpacked = math.prod(dataset.chunks) * dataset.id.get_type().get_size()
    return np.asarray((skipped <= every) & ((skipped != every) | (sizes == unpacked)))


def _is_found(dataset: h5py.Dataset, place: tuple[int, ...]) -> bool:
    """Whether HDF5 finds a chunk by its place. No byte of it is read: the buffer has no room."""
    try:
        dataset.id.read_direct_chunk(place, out=bytearray(1))
    except ValueError:  # too small a buffer: the look-up has told the chunk's size
        return True
    except (RuntimeError, OSError):
        return False
    return True
