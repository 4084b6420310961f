"""A digest that identifies a dataset independently of its path, date and container.

The digest covers the metadata that a build depends on, and voxels at a bounded cost. All voxels
are covered where they fit the budget. Otherwise the digest covers the coarsest level (an average
of the finer ones) and evenly spread blocks of the finest level.
"""

import hashlib
import json
import math
from collections.abc import Iterator, Sequence
from typing import Any, Protocol

import numpy as np

from stereocell.model.tiling import Box

BUDGET_BYTES = 64_000_000  # bytes after decoding; half for the coarsest level, half for the finest
_GOLDEN = 0.6180339887498949  # 1 / golden ratio, the step of a low-discrepancy sequence


class Fingerprinted(Protocol):
    """The parts of a dataset that the digest covers. `arrays` has one per level, finest first."""

    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def time(self) -> int: ...
    @property
    def levels(self) -> Sequence[Any]: ...
    @property
    def channels(self) -> Sequence[Any]: ...
    @property
    def arrays(self) -> Sequence[Any]: ...
    @property
    def modality(self) -> str: ...
    @property
    def placement(self) -> Any: ...
    @property
    def has_sides(self) -> bool: ...


def fingerprint_of(dataset: Fingerprinted) -> str:
    """Return the digest, 64 hex digits. Passes on the errors of the format's library."""
    metadata = {
        "dtype": dataset.dtype.name,
        "time": dataset.time,
        "levels": [[level.shape, level.spacing_um, level.origin_um] for level in dataset.levels],
        "channels": [[channel.name, channel.color] for channel in dataset.channels],
        "modality": dataset.modality,
        "placement": dataset.placement,
        "has_sides": dataset.has_sides,
    }
    digest = hashlib.sha256(json.dumps(metadata, sort_keys=True).encode())
    last = len(dataset.levels) - 1
    budget = BUDGET_BYTES // (2 if last else 1)
    for level in sorted({last, 0}, reverse=True):
        for channel, box in _spread(dataset, level, budget):
            voxels = dataset.arrays[level].window(dataset.time, channel, box)
            digest.update(repr((level, channel, box.start, box.stop)).encode())
            digest.update(np.ascontiguousarray(voxels, voxels.dtype.newbyteorder("<")).data)
    return digest.hexdigest()


def covers_all(dataset: Fingerprinted) -> bool:
    """Return whether the fingerprint covers every voxel of every level, not only a sample."""
    count = len(dataset.levels)
    budget = BUDGET_BYTES // min(count, 2)
    voxels = (len(dataset.channels) * math.prod(level.shape) for level in dataset.levels)
    return count <= 2 and max(voxels) * dataset.dtype.itemsize <= budget


def _spread(dataset: Fingerprinted, level: int, budget: int) -> Iterator[tuple[int, Box]]:
    """Yield (channel, box): the whole level where it fits `budget` (bytes), else some chunks."""
    whole = dataset.levels[level].box
    channels = len(dataset.channels)
    if channels * math.prod(whole.shape) * dataset.dtype.itemsize <= budget:
        yield from ((channel, whole) for channel in range(channels))
        return
    chunk = dataset.arrays[level].chunk
    counts = (channels, *(-(-n // c) for n, c in zip(whole.shape, chunk, strict=True)))
    wanted = max(1, min(math.prod(counts), budget // (math.prod(chunk) * dataset.dtype.itemsize)))
    # Multiples of the golden ratio spread evenly and never line up with an axis.
    indices = {int((k + 0.5) * _GOLDEN % 1.0 * math.prod(counts)) for k in range(wanted)}
    for index in sorted(indices):
        channel, *cell = (int(i) for i in np.unravel_index(index, counts))
        z, y, x = (i * c for i, c in zip(cell, chunk, strict=True))
        end_z, end_y, end_x = (
            min(a + c, n) for a, c, n in zip((z, y, x), chunk, whole.shape, strict=True)
        )
        yield channel, Box((z, y, x), (end_z, end_y, end_x))
