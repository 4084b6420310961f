"""Find where the objects of a label map are: voxels, box and centre of each, block by block.

The search uses runs of equal voxels along x, of which a label map has few.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Runs:
    """Runs of equal voxels along x of an array (z, y, x), in the array's order.

    values   (n,), in the array's dtype
    starts   int64 (n,), indices of voxels in the flat array
    lengths  int64 (n,), numbers of voxels
    """

    values: NDArray[np.integer]
    starts: NDArray[np.int64]
    lengths: NDArray[np.int64]

    @classmethod
    def of(cls, voxels: NDArray[np.integer]) -> "Runs":
        """Return the runs of an array of integers (z, y, x). No run passes the end of a row."""
        begins = np.ones(voxels.shape, bool)
        np.not_equal(voxels[..., 1:], voxels[..., :-1], out=begins[..., 1:])
        starts = np.flatnonzero(begins)
        lengths = np.diff(starts, append=voxels.size)
        return cls(voxels.ravel()[starts], starts, lengths)

    def spread(self, values: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return one value per voxel, flat, from one value per run."""
        return np.repeat(values, self.lengths)


@dataclass(frozen=True, slots=True)
class Extents:
    """The objects of a block, or of several blocks together: n of them, by rising label.

    labels     uint64 (n,), without 0
    voxels     int64 (n,), numbers of voxels
    low, high  int64 (n, 3), (z, y, x): half-open boxes in voxels
    sums       float64 (n, 3), (z, y, x): sums of the indices of their voxels
    """

    labels: NDArray[np.uint64]
    voxels: NDArray[np.int64]
    low: NDArray[np.int64]
    high: NDArray[np.int64]
    sums: NDArray[np.float64]

    @property
    def centroids(self) -> NDArray[np.float64]:
        """The means of the indices of their voxels, float64 (n, 3), (z, y, x)."""
        return self.sums / self.voxels[:, np.newaxis]


def find_extents(labels: NDArray[np.integer], start: tuple[int, int, int]) -> Extents:
    """Return voxels, boxes and centres of the objects in a block of a label map.

    labels  (z, y, x), integers of at least 0
    start   index of the block's first voxel in the label map; results are indices in the label map

    >>> found = find_extents(np.array([[[0, 7, 7], [0, 0, 9]]]), (10, 0, 0))
    >>> found.labels.tolist(), found.voxels.tolist(), found.low.tolist(), found.sums[0].tolist()
    ([7, 9], [2, 1], [[10, 0, 1], [10, 1, 2]], [20.0, 0.0, 3.0])
    """
    runs = Runs.of(labels)
    kept = runs.values != 0
    starts, lengths = runs.starts[kept], runs.lengths[kept]
    found, which = np.unique(runs.values[kept], return_inverse=True)
    places = np.stack(np.unravel_index(starts, labels.shape), axis=1) + np.asarray(start)
    ends = places + 1
    ends[:, 2] += lengths - 1
    sums = places * lengths[:, np.newaxis].astype(np.float64)
    sums[:, 2] += lengths * (lengths - 1) / 2
    return _gathered(found.astype(np.uint64), which, lengths, places, ends, sums)


def merge_extents(parts: Sequence[Extents]) -> Extents:
    """Return the extents of all blocks together. An object may lie in several blocks."""
    labels = np.concatenate([part.labels for part in parts] or [np.zeros(0, np.uint64)])
    found, which = np.unique(labels, return_inverse=True)
    if not len(labels):
        return _gathered(found, which, which, *(np.zeros((0, 3), np.int64),) * 2, np.zeros((0, 3)))
    return _gathered(
        found,
        which,
        np.concatenate([part.voxels for part in parts]),
        np.concatenate([part.low for part in parts]),
        np.concatenate([part.high for part in parts]),
        np.concatenate([part.sums for part in parts]),
    )


def _gathered(
    labels: NDArray[np.uint64],
    which: NDArray[np.int64],
    voxels: NDArray[np.int64],
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    sums: NDArray[np.float64],
) -> Extents:
    count = len(labels)
    order = np.argsort(which, kind="stable")
    firsts = np.searchsorted(which[order], np.arange(count))
    nothing = np.zeros((0, 3), np.int64)
    return Extents(
        labels,
        np.bincount(which, voxels, count).astype(np.int64),
        np.minimum.reduceat(low[order], firsts) if count else nothing,
        np.maximum.reduceat(high[order], firsts) if count else nothing,
        np.stack([np.bincount(which, axis, count) for axis in sums.T], axis=1),
    )
