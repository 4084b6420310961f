"""A channel's adaptive threshold in the report: the figure, other methods' thresholds, slices.

The others are thresholds of scikit-image on the same counts.

References: Otsu, "A threshold selection method from gray-level histograms", IEEE Transactions on
Systems, Man, and Cybernetics 9(1), 1979, https://doi.org/10.1109/TSMC.1979.4310076
Li & Tam, "An iterative algorithm for minimum cross entropy thresholding", Pattern Recognition
Letters 19(8), 1998, https://doi.org/10.1016/S0167-8655(98)00057-9
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray
from skimage import filters

from stereocell.model.spacing import Spacing
from stereocell.preview.draw_slices import Slice, draw_slices
from stereocell.preview.views import MICROSCOPE, View
from stereocell.report import charts
from stereocell.report.draw_scenes import Picture
from stereocell.transfer.adaptive_threshold import Histogram, Threshold
from stereocell.transfer.channel_statistics import ChannelStatistics

READINGS = {  # format arguments: the levels of Threshold.between
    "two peaks": "between the second-highest peak, at {1:.5g}, and the peak before it, at {0:.5g}",
    "no peak before": "between the second-highest peak, at {0:.5g}, before which there is none, "
    "and the next one, at {1:.5g}",
    "single peak": "at the foot of the longer side of the only peak, at {0:.5g}",
}
MAX_NAMED = 6  # largest number of chance rises that are listed
_ROOM = 1.6  # chart's top as a multiple of the second-highest peak: air, the highest, is cut
_LI_VOXELS = 200_000  # about the number of voxels that represent the counts in Li's method


@dataclass(frozen=True, slots=True)
class Row:
    """A threshold: its name, the class of its line, voxel value, share of the voxels above it."""

    name: str
    kind: str
    value: float
    above: float


@dataclass(frozen=True, slots=True)
class ThresholdFigure:
    """chart: histogram, smoothed, peaks, thresholds; ends: the axis' ends, in voxel values."""

    reading: str
    rows: tuple[Row, ...]
    chart: Markup
    ends: tuple[float, float]


def draw_threshold(statistics: ChannelStatistics) -> ThresholdFigure | None:
    """Return a channel's figure; None where it has no threshold."""
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
    """Return how a threshold follows from its peaks, and the rises that were dropped, as text."""
    reading = READINGS[found.reading].format(*found.between)
    left_out = ", ".join(f"{level:.5g}" for level in found.chance[:MAX_NAMED])
    if len(found.chance) > MAX_NAMED:
        left_out += f" and {len(found.chance) - MAX_NAMED} more"
    if not left_out:
        return reading
    return f"{reading}. Rises that counting alone may make, at {left_out}, are no peaks"


def find_peers(histogram: Histogram) -> tuple[float, float]:
    """Return Otsu's and Li's thresholds, voxel values. At least two bins must have counts."""
    counts, levels = np.asarray(histogram.counts), histogram.levels
    otsu = filters.threshold_otsu(hist=(counts, levels))
    fewer = np.ceil(counts * min(1.0, _LI_VOXELS / counts.sum())).astype(np.int64)
    li = filters.threshold_li(np.repeat(levels, fewer))
    return float(otsu), float(li)


def draw_cut(
    volume: NDArray[np.uint8],
    spacing_um: Spacing,
    threshold: float,
    *,
    views: Sequence[View] = MICROSCOPE,
) -> Picture:
    """Return a volume's mid-slices in which voxels below the threshold are hidden.

    volume     uint8 (z, y, x), windowed
    threshold  0..1 in the window
    views      ways to look at it
    """
    slices = []
    for view in views:
        order = view.order
        plane = view.plane(volume.transpose(order)[volume.shape[order[0]] // 2])
        grey = np.where(plane >= 255 * threshold, plane, 0).astype(np.uint8)
        spacing = (spacing_um[order[1]], spacing_um[order[2]])
        slices.append(Slice(view, grey, spacing, np.zeros((0, 2, 2)), None))
    return Picture(*draw_slices(slices))


def _share_above(statistics: ChannelStatistics, value: float) -> float:
    """Return the share of all voxels at or above a value, to within a bin of the window."""
    counts = np.asarray(statistics.histogram)
    upper = np.linspace(*statistics.window, len(counts) + 1)[1:]
    return float(counts[upper > value].sum() / counts.sum())
