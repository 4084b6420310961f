"""The adaptive binarisation threshold of a channel, between two peaks of its histogram.

The paper on streamed MRI states the rule. The histogram is smoothed by a moving window of 10 % of
its length. The threshold then lies between the second-highest peak and the peak before it. The rule
leaves some points open. Here they mean:

- Window: the mean over an odd number of bins. At the ends of the histogram it holds only existing
  bins. Added bins of zero would push a peak at the end away from it, such as the air around a head.
- Peak: a bin that is higher than both sides. A plateau is one peak, at its middle. At an end of the
  histogram one side is enough. Counting noise has peaks of its own where the mean is flat: in thin
  tails, and over a spike narrower than the window. So a peak counts only if it rises far enough
  above the saddle to any higher peak. The rise must exceed CHANCE standard deviations of the
  difference of two means of Poisson counts over the window. One such deviation is sqrt(2 height /
  its bins), for a height of at least one voxel. A peak that passes this test counts, however low it
  is beside the others.
- Second-highest: by the smoothed height. If heights are equal, the darker peak counts as the higher
  one, as air does.
- The peak before it: the next peak of lower intensity, of any height. In a head that is the air,
  the highest peak of all. If no peak lies before it (bright air, dark bodies), the threshold lies
  between it and the next peak of higher intensity.
- Between: at the lowest point of the smoothed histogram between the two peaks, or in the middle of
  a flat one. Fewest voxels lie there, so that a small error of the threshold changes the fewest
  (the mode method of Prewitt & Mendelsohn). The midpoint of the peaks would depend on their widths,
  and cut the broader one.
- A single peak has no peak before it. The threshold is then the foot of its longer side: the bin
  farthest below the line from the peak to that side's end. This is the triangle method of Zack,
  Rogers & Latt.
- A flat histogram, or one with a single filled bin, has no threshold.

References
J. M. S. Prewitt & M. L. Mendelsohn, "The analysis of cell images", Annals of the New York Academy
of Sciences 128, 1966. doi:10.1111/j.1749-6632.1965.tb11715.x
G. W. Zack, W. E. Rogers & S. A. Latt, Journal of Histochemistry and Cytochemistry 25, 1977.
doi:10.1177/25.7.70454
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stereocell.filters.codes import count_each, has_codes
from stereocell.kernels.value_counts import count_values

WINDOW_SHARE = 0.10  # length of the moving window as a share of the histogram's length
CHANCE = 5.0  # standard deviations by which a peak must rise above its saddle
BINS = 256  # largest number of bins of a histogram
_AT_ONCE = 1 << 16  # voxels that are counted together; as float64 they fit into a processor's cache
Reading = Literal["two peaks", "no peak before", "single peak"]


@dataclass(frozen=True, slots=True)
class Histogram:
    """Voxel counts in equal bins from `low` to `high`, in voxel values.

    counts  number of voxels in each bin
    """

    counts: tuple[int, ...]
    low: float
    high: float

    @property
    def levels(self) -> NDArray[np.float64]:
        """The middle of each bin, float64 (bins,), in voxel values."""
        middles = np.arange(len(self.counts), dtype=np.float64) + 0.5
        return np.asarray(self.low + middles * self.bin_width, np.float64)

    @property
    def bin_width(self) -> float:
        """The width of a bin, in voxel values."""
        return (self.high - self.low) / len(self.counts)


@dataclass(frozen=True, slots=True)
class Threshold:
    """A threshold, with the evidence for it that a chart shows.

    value     voxel value from which on voxels belong to the body
    peaks     levels of the peaks that count, rising, in voxel values
    between   the two peaks around the value, or the only one
    smoothed  float64 (bins,), the mean over the moving window, in voxels
    reading   the case of the rule that decided, such as "single peak"
    chance    levels of the peaks that counting noise may have caused
    """

    value: float
    peaks: tuple[float, ...]
    between: tuple[float, ...]
    smoothed: NDArray[np.float64]
    reading: Reading
    chance: tuple[float, ...]


def make_histogram(voxels: NDArray[Any], window: tuple[float, float]) -> Histogram:
    """Return the counts of the voxels within the window, in at most BINS bins.

    voxels  any shape, any number type, voxel values
    window  lowest and highest voxel value that are counted

    Voxels outside of the window are left out. Hot voxels would stretch the histogram, and so the
    moving window; if clipped, they would make a peak. For integers the width of a bin is a whole
    number. Other widths would hold sometimes two and sometimes three integers, like a comb.
    """
    low, high = window
    bins = BINS
    if voxels.dtype.kind in "iub":
        first, last = np.ceil(low), np.floor(high)
        width = max(1.0, np.ceil((last - first + 1) / BINS))
        bins = max(1, int(np.ceil((last - first + 1) / width)))
        low, high = float(first - 0.5), float(first - 0.5 + bins * width)
    counts = count_in_bins(voxels, np.linspace(low, high, bins + 1), window, clips=False)
    return Histogram(tuple(int(n) for n in counts), float(low), float(high))


def count_in_bins(
    voxels: NDArray[Any], edges: NDArray[np.float64], window: tuple[float, float], *, clips: bool
) -> NDArray[np.int64]:
    """Return the number of voxels in even bins, int64 (bins,).

    voxels  any shape, any number type, voxel values
    edges   ends of the bins, (bins + 1,), rising
    window  lowest and highest value that is counted, within the edges
    clips   whether voxels beyond the window are clipped to it; otherwise they are left out
    """
    counts = np.zeros(len(edges) - 1, np.int64)
    low, high = (float(end) for end in window)
    if has_codes(voxels.dtype):
        values, times = count_each(voxels)
        count_values(values.astype(np.float64), times, edges, low, high, clips, counts)
        return counts
    flat, once = voxels.reshape(-1), np.ones(_AT_ONCE, np.int64)
    for start in range(0, flat.size, _AT_ONCE):
        part = flat[start : start + _AT_ONCE].astype(np.float64)
        count_values(part, once, edges, low, high, clips, counts)
    return counts


def find_adaptive_threshold(histogram: Histogram) -> Threshold | None:
    """Return the threshold, or None for a flat histogram such as that of a constant channel.

    >>> random = np.random.default_rng(0)
    >>> voxels = np.concatenate([random.normal(200, 20, 9000), random.normal(800, 40, 3000)])
    >>> found = find_adaptive_threshold(make_histogram(voxels, (0, 1000)))
    >>> found.reading, [round(peak, -2) for peak in found.peaks], 300 < found.value < 700
    ('two peaks', [200.0, 800.0], True)
    """
    counts = np.asarray(histogram.counts, dtype=np.float64)
    if np.count_nonzero(counts) < 2 or counts.min() == counts.max():
        return None
    smoothed = smooth(counts)
    peaks, chance = _find_peaks(smoothed)
    if not peaks:
        return None

    def level(place: float) -> float:
        return histogram.low + (place + 0.5) * histogram.bin_width

    reading: Reading = "single peak"
    between: tuple[float, ...]
    if len(peaks) == 1:
        between, place = (peaks[0],), _foot(smoothed, peaks[0])
    else:
        height = {peak: smoothed[int(peak)] for peak in peaks}
        second = sorted(peaks, key=lambda peak: (-height[peak], peak))[1]
        at = peaks.index(second)
        reading = "two peaks" if at else "no peak before"
        between = (peaks[at - 1], second) if at else (second, peaks[1])
        place = _valley(smoothed, int(between[0]), int(between[1]))
    return Threshold(
        level(place),
        tuple(level(peak) for peak in peaks),
        tuple(level(peak) for peak in between),
        smoothed,
        reading,
        tuple(level(peak) for peak in chance),
    )


def smooth(counts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the moving mean of counts (bins,), float64 (bins,).

    The window has WINDOW_SHARE of the bins, rounded to an odd number of at least one.
    """
    sums = np.concatenate([[0.0], np.cumsum(counts)])
    first, stop = _windows(len(counts))
    mean: NDArray[np.float64] = (sums[stop] - sums[first]) / (stop - first)
    return mean


def _windows(bins: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where the window of each bin begins and ends, cut off at the histogram's ends."""
    half = int(WINDOW_SHARE * bins) // 2
    at = np.arange(bins, dtype=np.int64)
    return np.maximum(at - half, 0), np.minimum(at + half + 1, bins)


def _find_peaks(heights: NDArray[np.float64]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the middles, in bins, of the peaks that count and of those by chance; both rising."""
    # Starts of runs of equal heights
    starts = np.flatnonzero(np.diff(heights, prepend=np.nan) != 0)
    stops = np.append(starts[1:], len(heights))
    runs = heights[starts]
    if len(runs) == 1:
        return (), ()
    first, stop = _windows(len(heights))
    padded = np.concatenate([[-np.inf], runs, [-np.inf]])
    tops = np.flatnonzero((runs > padded[:-2]) & (runs > padded[2:]))
    found: list[float] = []
    chance: list[float] = []
    for top in tops:
        saddles = []
        for side in (runs[top::-1], runs[top:]):
            higher = np.flatnonzero(side > runs[top])
            if len(higher):
                saddles.append(side[: higher[0]].min())
        saddle = max(saddles, default=0.0)
        place = float(starts[top] + stops[top] - 1) / 2
        deviation = np.sqrt(2 * max(runs[top], 1.0) / (stop - first)[int(place)])
        is_real = runs[top] - saddle > CHANCE * deviation
        (found if is_real else chance).append(place)
    return tuple(found), tuple(chance)


def _valley(heights: NDArray[np.float64], first: int, last: int) -> float:
    """Return the lowest bin between two peaks; of several, the middle of the first run."""
    between = heights[first : last + 1]
    start = int(between.argmin())
    higher = np.flatnonzero(between[start:] > between[start])
    stop = start + int(higher[0]) if len(higher) else len(between)
    return first + (start + stop - 1) / 2


def _foot(heights: NDArray[np.float64], peak: float) -> float:
    """Return the bin farthest below the line from the peak to the end of its longer side."""
    top, filled = int(peak), np.flatnonzero(heights)
    end = int(max(filled[0], filled[-1], key=lambda bin_: abs(int(bin_) - top)))
    bins = np.linspace(top, end, abs(end - top) + 1)
    line = np.interp(np.arange(len(bins)), [0, len(bins) - 1], [heights[top], heights[end]])
    # The vertical distance is used. That at right angles differs only by a constant factor.
    return float(bins[int((line - heights[bins.astype(int)]).argmax())])
