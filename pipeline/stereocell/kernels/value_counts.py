"""Histograms of values in even bins. NumPy's take ten times as long, mostly for copies."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel


@kernel
def count_values(
    values: NDArray[np.float64],
    edges: NDArray[np.float64],
    low: float,
    high: float,
    clips: bool,
    counts: NDArray[np.int64],
) -> None:
    """Add the number of values in each bin.

    values     (n,); NaN is left out
    edges      ends of the bins (bins + 1,), evenly spaced; the last bin holds its upper end, too
    low, high  least and largest value that is counted, within the edges
    clips      whether values beyond them are clipped to them; otherwise they are left out
    counts     (bins,)
    """
    bins = len(counts)
    scale = bins / (edges[bins] - edges[0])
    for value in values:
        if clips:
            value = min(max(value, low), high)
        if not low <= value <= high:
            continue
        place = (value - edges[0]) * scale
        at = int(place) if place < bins else bins - 1  # NaN, too, where the bins have no width
        # Rounding may have moved a value that lies near an edge.
        if value < edges[at]:
            at -= 1
        elif at + 1 < bins and value >= edges[at + 1]:
            at += 1
        counts[at] += 1
