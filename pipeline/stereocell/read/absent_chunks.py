"""Count the chunks that are not stored. Zarr, N5 and HDF5 read them as a fill value.

The formats allow absent chunks, because writers leave out empty ones. A lost chunk looks the same,
so the share of absent chunks is reported. The caller refuses a level without any stored chunk.
"""

from collections.abc import Sequence
from typing import Any

from stereocell.model.tiling import Box
from stereocell.read.chunk_counts import Absent, Spans
from stereocell.read.dataset import Dataset, VoxelArray
from stereocell.read.flipped_array import FlippedArray
from stereocell.read.inverted_array import InvertedArray
from stereocell.read.known_formats import format_of
from stereocell.read.modulo import PartAlong
from stereocell.read.value_scale import ScaledArray
from stereocell.storage.file_states import FileStates


def count_absent(
    dataset: Dataset, channels: Sequence[int], box: Box, level: int, states: FileStates
) -> Absent | None:
    """Return how many chunks in a box of some channels are absent; None: they can't be counted.

    states  states of the source's files when they were listed
    """
    array = dataset.arrays[level]
    stored: Any = array.array
    if isinstance(stored, InvertedArray):
        stored = stored.stored
    spans = _spans(array, dataset.time, channels, box)
    while isinstance(stored, FlippedArray | ScaledArray | PartAlong):
        spans = spans if isinstance(stored, ScaledArray) else stored.stored_spans(spans)
        stored = stored.stored
    count = format_of(dataset.source).count_absent
    if count is None or not states.is_complete:
        return None
    return count(stored, spans, states)


def _spans(array: VoxelArray, time: int, channels: Sequence[int], box: Box) -> Spans:
    """Return the ranges of indices to read along each axis."""
    wanted = {
        **{axis: [range(a, b)] for axis, a, b in zip("zyx", box.start, box.stop, strict=True)},
        "t": [range(time, time + 1)],
        "c": [range(c, c + 1) for c in channels],
    }
    return [wanted.get(axis, [range(1)]) for axis in array.axes]
