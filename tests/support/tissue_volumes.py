"""Volumes of known tissue classes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Labels = NDArray[np.integer[Any]]


def blobs(count: int) -> tuple[NDArray[np.uint16], Labels]:
    """Return blobs of `count` tissues in air, with values 400, 600, ..., noise and a bias."""
    rng = np.random.default_rng(count)
    shape = (32, 40, 40)
    field = ndimage.gaussian_filter(rng.standard_normal(shape), 5)
    levels = np.quantile(field, np.linspace(0, 1, count + 1)[1:-1])
    labels = np.pad((np.digitize(field, levels) + 1)[3:-3, 3:-3, 3:-3], 3)
    signal = 200.0 * (labels + (labels > 0)) * (1 + 0.15 * np.linspace(-1, 1, shape[2]))
    return np.abs(signal + rng.normal(0, 30, shape)).astype(np.uint16), labels
