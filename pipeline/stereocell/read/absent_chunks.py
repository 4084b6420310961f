"""Count the chunks that are not stored. Zarr, N5 and HDF5 read them as a fill value.

Formats allow this, because writers leave out empty chunks. A chunk that was lost looks the same, so
the share of absent chunks is reported. A level without any stored chunk is refused by the caller.
"""

import math
from collections.abc import Callable, Iterator, Sequence, Set
from dataclasses import dataclass
from itertools import product
from typing import Any

from stereocell.model.tiling import Box
from stereocell.read.dataset import Dataset, VoxelArray
from stereocell.read.flipped_array import FlippedArray
from stereocell.read.inverted_array import InvertedArray
from stereocell.read.known_formats import format_of
from stereocell.read.modulo import PartAlong
from stereocell.read.value_scale import ScaledArray
from stereocell.storage.file_states import FileStates

_MOST_COUNTED = 2_000_000  # most chunks that are looked for; a part with more is not counted
Spans = Sequence[Sequence[range]]  # for each axis the ranges of indices that are read


@dataclass(frozen=True, slots=True)
class Absent:
    """The number of chunks of a part of a level that are not stored.

    count  chunks that are absent
    total  all chunks of the part
    noun   `chunk`, `shard` or `block`
    fill   the value that is read for absent chunks
    """

    count: int
    total: int
    noun: str
    fill: Any


def count_absent(
    dataset: Dataset, channels: Sequence[int], box: Box, level: int, states: FileStates
) -> Absent | None:
    """Return how many chunks of a box of some channels are absent; None: they can't be counted.

    states  the source's files, as they were listed
    """
    array = dataset.arrays[level]
    stored: Any = array.array
    if isinstance(stored, InvertedArray):
        stored = stored.stored
    spans = _spans(array, dataset.time, channels, box)
    while isinstance(stored, FlippedArray | ScaledArray | PartAlong):
        spans = spans if isinstance(stored, ScaledArray) else stored.stored_spans(spans)
        stored = stored.stored
    count = _COUNTERS.get(format_of(dataset.source).name)
    if count is None or not states.is_complete:
        return None
    return count(stored, spans, states)


def _in_zarr(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    from stereocell.read.formats.ome_zarr.store import (
        GuardedStore,  # slow to import, and loaded by its reader
    )

    if not isinstance(getattr(stored, "store", None), GuardedStore):
        return None
    sizes, noun = (stored.shards, "shard") if stored.shards else (stored.chunks, "chunk")
    if _number(sizes, spans) > _MOST_COUNTED:
        return None
    others, members = stored.store.other_names, stored.store.members
    names = members or states.names()
    # The one image of a container is a group of its own below the source that was listed.
    below = stored.store.source.removeprefix(states.location.source).strip("/")
    outside = f"{below}/" if below and members is None else ""

    def is_present(place: tuple[int, ...]) -> bool:
        key = f"{stored.path}/{stored.metadata.encode_chunk_key(place)}".lstrip("/")
        if outside + key in names:
            return True
        return others is not None and outside + others.key_of(key) in names

    is_listed = stored.store.is_local and _number(stored.chunks, spans) <= _MOST_COUNTED
    if stored.shards and is_listed:  # at an address each index is a request
        from stereocell.read.formats.ome_zarr.shard_index import absent_in_shards

        pairs = zip(stored.chunks, spans, strict=True)
        touched = [_of_axis(size, ranges) for size, ranges in pairs]
        inner = absent_in_shards(stored, touched, is_present)
        if inner is not None and inner[2]:
            return Absent(inner[0], inner[1], "chunk", stored.fill_value)
    found = [is_present(place) for place in _places(sizes, spans)]
    return Absent(found.count(False), len(found), noun, stored.fill_value)


def _in_n5(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    if hasattr(stored, "view"):
        return _in_views(stored, spans, states)
    if not hasattr(stored, "path_of") or _number(stored.chunks, spans) > _MOST_COUNTED:
        return None
    names = states.names()
    # Under BigDataViewer's XML the files lie beside the source, not below it.
    outside = "" if stored.folder == states.location.source else f"{stored.folder.lstrip('/')}/"
    paths = (outside + stored.path_of(place) for place in _places(stored.chunks, spans))
    return _counted(paths, names, "block", 0)


def _in_views(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    """Count the blocks of BigDataViewer's views, of which each is an array of its own."""
    times, channels, *place = spans
    found = []
    for time in (n for one in times for n in one):
        for channel in (n for one in channels for n in one):
            view = stored.view(time, channel)
            count = _in_n5 if hasattr(view, "path_of") else _in_hdf5
            found.append(count(view, place, states))
    known = [one for one in found if one is not None]
    if not known or len(known) < len(found):
        return None
    return Absent(
        sum(one.count for one in known), sum(one.total for one in known), known[0].noun, 0
    )


def _in_hdf5(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    """Count the chunks of the whole dataset: HDF5 gives their number at no cost."""
    if hasattr(stored, "view"):
        return _in_views(stored, spans, states)
    dataset = getattr(stored, "dataset", None)
    if dataset is None or dataset.chunks is None:
        return None
    pairs = zip(dataset.shape, dataset.chunks, strict=True)
    total = math.prod(-(-size // chunk) for size, chunk in pairs)
    return Absent(total - int(dataset.id.get_num_chunks()), total, "chunk", dataset.fillvalue)


_COUNTERS: dict[str, Callable[[Any, Spans, FileStates], Absent | None]] = {
    "ome-zarr": _in_zarr,
    "n5": _in_n5,
    "hdf5": _in_hdf5,
    "bdv": _in_views,
}


def _spans(array: VoxelArray, time: int, channels: Sequence[int], box: Box) -> Spans:
    """Return for each axis the ranges of indices that are read."""
    wanted = {
        **{axis: [range(a, b)] for axis, a, b in zip("zyx", box.start, box.stop, strict=True)},
        "t": [range(time, time + 1)],
        "c": [range(c, c + 1) for c in channels],
    }
    return [wanted.get(axis, [range(1)]) for axis in array.axes]


def _of_axis(size: int, ranges: Sequence[range]) -> list[int]:
    """Return the chunks along one axis, of `size` voxels each, that some ranges touch."""
    return sorted({n for one in ranges for n in range(one.start // size, -(-one.stop // size))})


def _number(sizes: Sequence[int], spans: Spans) -> int:
    return math.prod(_count(n, ranges) for n, ranges in zip(sizes, spans, strict=True))


def _count(size: int, ranges: Sequence[range]) -> int:
    """Return the number of chunks along one axis; without a list of them, which may be long."""
    count, reached = 0, 0
    for one in sorted(ranges, key=lambda one: one.start):
        first, stop = max(one.start // size, reached), -(-one.stop // size)
        if stop > first:
            count, reached = count + stop - first, stop
    return count


def _places(sizes: Sequence[int], spans: Spans) -> Iterator[tuple[int, ...]]:
    return product(*(_of_axis(n, ranges) for n, ranges in zip(sizes, spans, strict=True)))


def _counted(keys: Iterator[str], names: Set[str], noun: str, fill: Any) -> Absent:
    total = count = 0
    for key in keys:
        total += 1
        count += key not in names
    return Absent(count, total, noun, fill)
