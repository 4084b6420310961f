"""Draw a channel's adaptive threshold for the report, beside thresholds of other methods.

The other thresholds, Otsu's and Li's, are computed by scikit-image from the same counts.

References: Otsu, "A threshold selection method from gray-level histograms", IEEE Transactions on
Systems, Man, and Cybernetics 9(1), 1979, https://doi.org/10.1109/TSMC.1979.4310076
Li & Tam, "An iterative algorithm for minimum cross entropy thresholding", Pattern Recognition
Letters 19(8), 1998, https://doi.org/10.1016/S0167-8655(98)00057-9
"""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from stereocell.report import charts
from stereocell.transfer.adaptive_threshold import Histogram, Threshold
from stereocell.transfer.channel_statistics import ChannelStatistics

READINGS = {  # Threshold.reading: sentence; its format arguments are Threshold.between
    "two peaks": "between the second-highest peak, at {1:.5g}, and the peak before it, at {0:.5g}",
    "no peak before": "between the second-highest peak, at {0:.5g}, which is the first, "
    "and the next one, at {1:.5g}",
    "single peak": "at the foot of the longer side of the only peak, which is at {0:.5g}",
}
MAX_NAMED = 6  # largest number of listed peaks that may be due to chance
_ROOM = 1.6  # top of the chart, as a multiple of the second-highest peak; air is often higher
_LI_VOXELS = 200_000  # approximate number of voxels that represent the counts in Li's method


@dataclass(frozen=True, slots=True)
class Row:
    """One threshold in the figure: the adaptive one, or that of another method.

    kind   CSS class of the threshold's line in the chart
    value  the threshold as a voxel value
    above  share of the voxels above it, 0..1
    """

    name: str
    kind: str
    value: float
    above: float


@dataclass(frozen=True, slots=True)
class ThresholdFigure:
    """A chart of histogram, peaks and thresholds.

    reading  how the adaptive threshold follows from the peaks
    ends     smallest and largest voxel value of the axis
    """

    reading: str
    rows: tuple[Row, ...]
    chart: Markup
    ends: tuple[float, float]


def draw_threshold(statistics: ChannelStatistics) -> ThresholdFigure | None:
    """Return a channel's figure, or None where it has no adaptive threshold."""
    found, values = statistics.threshold, statistics.values
    if found is None:
        return None
    otsu, li = find_peers(values)
    rows = tuple(
        Row(name, kind, value, _share_above(statistics, value))
        for name, kind, value in (
            ("adaptive", "mark", found.value), ("Otsu", "otsu", otsu), ("Li", "li", li)
        )
    )  # fmt: skip
    span = values.high - values.low

    def place(level: float) -> float:
        return (level - values.low) / span

    heights = sorted(found.smoothed[int(place(p) * len(values.counts))] for p in found.peaks)
    chart = charts.threshold(
        values.counts,
        found.smoothed,
        top=_ROOM * float(heights[-2:][0]),
        peaks=[place(level) for level in found.peaks],
        rules={row.kind: place(row.value) for row in reversed(rows)},
    )
    return ThresholdFigure(describe(found), rows, chart, (values.low, values.high))


def describe(found: Threshold) -> str:
    """Return as text how a threshold follows from its peaks, and which rises were ignored."""
    reading = READINGS[found.reading].format(*found.between)
    left_out = ", ".join(f"{level:.5g}" for level in found.chance[:MAX_NAMED])
    if len(found.chance) > MAX_NAMED:
        left_out += f" and {len(found.chance) - MAX_NAMED} more"
    if not left_out:
        return reading
    return f"{reading}. Rises at {left_out} may be due to chance and were ignored"


def find_peers(histogram: Histogram) -> tuple[float, float]:
    """Return Otsu's and Li's thresholds as voxel values. At least two bins must have counts."""
    from skimage import filters  # slow to import

    counts, levels = np.asarray(histogram.counts), histogram.levels
    otsu = filters.threshold_otsu(hist=(counts, levels))
    fewer = np.ceil(counts * min(1.0, _LI_VOXELS / counts.sum())).astype(np.int64)
    li = filters.threshold_li(np.repeat(levels, fewer))
    return float(otsu), float(li)


def _share_above(statistics: ChannelStatistics, value: float) -> float:
    """Return the share of all voxels at or above a value, exact to one bin of the window."""
    counts = np.asarray(statistics.histogram)
    upper = np.linspace(*statistics.window, len(counts) + 1)[1:]
    return float(counts[upper > value].sum() / counts.sum())
