"""Voxels that are NaN or infinite: places without a measurement, read as the darkest value.

Registered stacks have NaN outside the field of view. Ratios and logarithms have NaN and infinity
where there was no signal. These voxels are read as the channel's smallest finite value. One value
for the whole channel makes neighbouring tiles agree, and the rule for padding
(isosurface/level_evidence.py) recognises it.
"""

import math
from collections.abc import Iterable, Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from stereocell.model.tiling import Box

_SLAB_BYTES = 1 << 26  # bytes read at once, where the chunks permit


class Searched(Protocol):
    """The parts of a level's voxels that the search needs (dataset.VoxelArray)."""

    @property
    def shape(self) -> tuple[int, int, int]: ...
    @property
    def chunk(self) -> tuple[int, int, int]: ...
    @property
    def array(self) -> Any: ...
    def stored_window(self, time: int, channel: int, box: Box) -> NDArray[Any]: ...


def least_finite(array: Searched, time: int, channel: int) -> float | None:
    """Return the smallest finite voxel; None: no voxel is finite. All voxels are read."""
    least = math.inf
    for box in _slabs(array):
        stored = array.stored_window(time, channel, box)
        least = min(least, float(np.min(stored, where=np.isfinite(stored), initial=np.inf)))
    return None if least == math.inf else least


def share_of_gaps(array: Searched, time: int, channel: int, boxes: Iterable[Box]) -> float:
    """Return the share (0..1) of the voxels in some boxes that are NaN or infinite."""
    gaps = total = 0
    for box in boxes:
        stored = array.stored_window(time, channel, box)
        gaps += stored.size - int(np.count_nonzero(np.isfinite(stored)))
        total += stored.size
    return gaps / max(1, total)


def _slabs(array: Searched) -> Iterator[Box]:
    """Yield boxes of whole chunks along z and y that together fill the array."""
    depth, height, width = array.shape
    deep, high, _ = array.chunk
    row = width * np.dtype(array.array.dtype).itemsize
    layers = _SLAB_BYTES // (deep * height * row)
    deep *= max(1, layers)
    high = height if layers else high * max(1, _SLAB_BYTES // (deep * high * row))
    for z in range(0, depth, deep):
        for y in range(0, height, high):
            yield Box((z, y, 0), (min(z + deep, depth), min(y + high, height), width))
