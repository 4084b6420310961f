"""Measure a channel of the image over the voxels of objects."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

PERCENTILE = 95.0
NO_PIECES = np.zeros(0, np.int32)
# Number of quantiles of a piece; the share of an object's percentile is exact to 0.001
QUANTILES = 1001


@dataclass(frozen=True, slots=True)
class Intensities:
    """Measurements of n objects, in the voxels' unit.

    mean, p95  float64 (n,), mean and 95th percentile
    quantiles  float32 (k, QUANTILES), of the k pieces
    """

    mean: NDArray[np.float64]
    p95: NDArray[np.float64]
    quantiles: NDArray[np.float32]


def measure_intensities(
    labels: NDArray[np.int32],
    voxels: NDArray[Any],
    numbers: NDArray[np.int32],
    *,
    pieces: NDArray[np.int32] = NO_PIECES,
) -> Intensities:
    """Return the mean and the percentile of the voxels of each object.

    labels   int32 (z, y, x)
    voxels   (z, y, x), any number type
    numbers  int32 (n,), rising: objects, which all have voxels
    pieces   int32 (k,): those of them that are only pieces of an object

    The percentile is interpolated linearly between voxels, as in numpy.

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
    p95 = _quantile(values, firsts, counts, PERCENTILE / 100)
    cut = np.searchsorted(numbers, pieces)
    shares = np.linspace(0, 1, QUANTILES)
    found = [_quantile(values, firsts[cut], counts[cut], share) for share in shares]
    return Intensities(mean, p95, np.stack(found, axis=1).astype(np.float32))


def _quantile(
    values: NDArray[np.float64], firsts: NDArray[np.int64], counts: NDArray[np.int64], share: float
) -> NDArray[np.float64]:
    """Return a quantile of each object from its `counts` rising values, which begin at `firsts`."""
    at = share * (counts - 1)
    below = np.floor(at).astype(np.int64)
    above = np.minimum(below + 1, counts - 1)
    low, high = values[firsts + below], values[firsts + above]
    return low + (at - below) * (high - low)


def merge_quantiles(
    quantiles: NDArray[np.float32], voxels: NDArray[np.int64], *, share: float = PERCENTILE / 100
) -> float:
    """Return a quantile of an object that consists of k pieces.

    quantiles  float32 (k, q), of each piece, evenly spaced from its least to its largest value
    voxels     int64 (k,), number of voxels of each piece
    share      share of the voxels below the quantile, 0..1

    >>> pieces = np.array([[0, 1, 2], [10, 11, 12]], np.float32)
    >>> merge_quantiles(pieces, np.array([30, 10]), share=0.9)
    11.0
    """
    count = quantiles.shape[1]
    weights = np.repeat(voxels / count, count)
    order = np.argsort(quantiles.ravel(), kind="stable")
    reached = np.cumsum(weights[order])
    at = min(int(np.searchsorted(reached, share * reached[-1])), len(order) - 1)
    return float(quantiles.ravel()[order][at])
