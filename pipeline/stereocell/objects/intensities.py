"""What a channel of the image is over objects."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

PERCENTILE = 95.0


@dataclass(frozen=True, slots=True)
class Measured:
    """Mean and 95th percentile of n objects, float64 (n,), in the voxels' unit."""

    mean: NDArray[np.float64]
    p95: NDArray[np.float64]


def measure_intensities(
    labels: NDArray[np.int32], voxels: NDArray[Any], numbers: NDArray[np.int32]
) -> Measured:
    """Return mean and percentile of the voxels of each object.

    labels   int32 (z, y, x)
    voxels   (z, y, x), any number type
    numbers  int32 (n,), ascending, of objects that have voxels

    The percentile is linear between voxels, as numpy's.

    >>> labels = np.repeat(np.arange(1, 3, dtype=np.int32), 3).reshape(1, 2, 3)
    >>> found = measure_intensities(labels, np.arange(6).reshape(1, 2, 3), np.array([1, 2]))
    >>> found.mean.tolist(), found.p95.tolist()
    ([1.0, 4.0], [1.9, 4.9])
    """
    is_ours = np.zeros(int(labels.max(initial=0)) + 1, bool)
    is_ours[numbers] = True
    inside = is_ours[labels]
    own = np.searchsorted(numbers, labels[inside])
    values = voxels[inside]
    order = np.lexsort((values, own))
    values = values[order].astype(np.float64)
    counts = np.bincount(own, minlength=len(numbers))
    firsts = np.cumsum(counts) - counts
    mean = np.bincount(own[order], values, len(numbers)) / np.maximum(counts, 1)
    at = PERCENTILE / 100 * (counts - 1)
    below = np.floor(at).astype(np.int64)
    above = np.minimum(below + 1, counts - 1)
    low, high = values[firsts + below], values[firsts + above]
    return Measured(mean, low + (at - below) * (high - low))
