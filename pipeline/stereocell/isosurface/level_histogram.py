"""A histogram of field values that is summed over tiles, and the levels that it shows.

Its bins are narrow near the channel's usual values and grow with the distance from them: they are
even in the inverse hyperbolic sine of the value. So a few voxels of 60 000 leave the difference of
100 and 110 visible. Counts are whole numbers, so their sum over tiles is the same in any order.

References
C. H. Li & P. K. S. Tam, "An iterative algorithm for minimum cross entropy thresholding", Pattern
Recognition Letters 19, 1998. doi:10.1016/S0167-8655(98)00057-9
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.filters.percentiles import find_median, find_percentiles
from stereocell.model.lattice_field import LatticeField

BINS = 4096
INSIDE = 0.6  # quantile of the voxels above a level that counts as the height of the bodies
OUTSIDE = 0.5  # quantile of the voxels below a level that counts as the height of the surroundings
DARK = 0.05  # quantile that counts as the dark end, from which values are measured in noise
_LOWEST_QUANTILE = 0.001  # quantile that is 0 for Li's threshold, which needs values above 0
_FINE = 1 << 16  # number of even bins in a first pass: faster than a hyperbolic sine for each value
_SPREAD = 90.0  # range of the values over the distance from the middle at which bins begin to grow
_STEPS = 200
_CLOSE = 1e-4  # share of the contrast; a smaller step ends a search
_STEP = 0.02  # step of the stabilised axis, whose unit is twice the noise at the dark end
_SIGMA = 0.15  # sigma of the smoothing along the stabilised axis
DIP = 0.7  # largest height of a valley, as a share of the lower of its two peaks
_FLAT = 1.5  # multiple of a valley's least height up to which voxels belong to the valley
_ENDS = (0.0002, 0.9999)  # quantiles between which peaks are looked for


@dataclass(frozen=True, slots=True)
class Scale:
    """Where the bins lie, in voxel values: from `low` to `high`, narrowest at `middle`."""

    low: float
    high: float
    middle: float

    @classmethod
    def of(cls, voxels: NDArray[Any], padding: NDArray[np.bool_]) -> "Scale":
        """Return the scale for the fields of a channel from a sample of its voxels.

        voxels   any shape, any number type
        padding  bool, the same shape; the middle is the median of the other voxels

        The field is smoother than its voxels, so nearly all of it lies within their range. A few
        hot voxels lie beyond and are counted in the last bin.
        """
        low, high = find_percentiles(voxels, (0.001, 99.999))
        kept = voxels[~padding] if padding.any() else voxels
        middle = find_median(kept)
        margin = 0.05 * (high - low) or max(1.0, 1e-6 * abs(low))
        return cls(low - margin, high + margin, middle)

    def above(self, background: LatticeField) -> "Scale":
        """Return the scale for the values above a background."""
        under = background.values
        least, most = float(under.min()), float(under.max())
        return Scale(self.low - most, self.high - least, self.middle - float(under.mean()))

    def edges(self) -> NDArray[np.float64]:
        """Return the ends of the bins, float64 (BINS + 1,), rising, voxel values."""
        width = (self.high - self.low) / _SPREAD
        first, last = np.arcsinh((np.array([self.low, self.high]) - self.middle) / width)
        edges = self.middle + width * np.sinh(np.linspace(first, last, BINS + 1))
        edges[0], edges[-1] = self.low, self.high
        return np.asarray(edges, np.float64)

    def bins_of(self, values: NDArray[np.float32]) -> NDArray[np.int16]:
        """Return each value's bin, int16 of the same shape. Outer values count in the end bins."""
        table, step = self.table()
        place = values - np.float32(self.low)
        place /= np.float32(step)
        np.clip(place, 0, _FINE - 1, out=place)
        return table[place.astype(np.uint16)]

    def table(self) -> tuple[NDArray[np.int16], float]:
        """Return the bin of each of _FINE even steps from `low`, int16, and the step's width."""
        return _table_of(self)


@lru_cache(maxsize=4)  # one channel's blocks are counted one after another
def _table_of(scale: Scale) -> tuple[NDArray[np.int16], float]:
    step = (scale.high - scale.low) / _FINE
    fine = scale.low + (np.arange(_FINE) + 0.5) * step
    table = np.clip(np.searchsorted(scale.edges(), fine, "right") - 1, 0, BINS - 1)
    return table.astype(np.int16), step


@dataclass(frozen=True, slots=True)
class Valley:
    """A gap between two peaks, in voxel values.

    value       the lowest point
    low, high   the ends of the valley; the histogram rises beyond them
    peak        the upper one of the two peaks
    dip         the least height as a share of the lower peak, 0..1
    """

    value: float
    low: float
    high: float
    peak: float
    dip: float


@dataclass(frozen=True)
class LevelHistogram:
    """Voxel counts, float64 (BINS,), in bins whose ends are `edges`, float64 (BINS + 1,).

    The edges are in voxel values.
    """

    counts: NDArray[np.float64]
    edges: NDArray[np.float64]

    @cached_property
    def centres(self) -> NDArray[np.float64]:
        """The middles of the bins, float64 (BINS,), voxel values."""
        return (self.edges[1:] + self.edges[:-1]) / 2

    @cached_property
    def total(self) -> float:
        """The number of voxels."""
        return float(self.counts.sum())

    @cached_property
    def variance(self) -> float:
        """The variance of the voxels; 0 without a voxel."""
        if not self.total:
            return 0.0
        mean = np.average(self.centres, weights=self.counts)
        return float(np.average((self.centres - mean) ** 2, weights=self.counts))

    def between(self, low: float, high: float) -> "LevelHistogram":
        """Return the histogram of only the voxels above `low` and up to `high`."""
        kept = (self.centres > low) & (self.centres <= high)
        return LevelHistogram(np.where(kept, self.counts, 0.0), self.edges)

    def above(self, level: float) -> "LevelHistogram":
        """Return the histogram of only the voxels above a level."""
        return self.between(level, np.inf)

    def below(self, level: float) -> "LevelHistogram":
        """Return the histogram of only the voxels at or below a level."""
        return self.between(-np.inf, level)

    def quantile(self, share: float) -> float:
        """Return the value below which the share (0..1) of the voxels lies; NaN without a voxel."""
        sums = np.cumsum(self.counts)
        return float(np.interp(share * sums[-1], sums, self.centres)) if sums[-1] else np.nan

    def width_at(self, value: float) -> float:
        """Return the width of the bin that holds a value, in voxel values."""
        at = int(np.clip(np.searchsorted(self.edges, value) - 1, 0, len(self.counts) - 1))
        return float(self.edges[at + 1] - self.edges[at])

    def li_threshold(self) -> float:
        """Return the level of least cross entropy (Li & Tam), in voxel values."""
        least = self.quantile(_LOWEST_QUANTILE)
        values = np.maximum(self.centres - least, 1e-6)
        level = float(np.average(values, weights=self.counts))
        for _ in range(_STEPS):
            above = values > level
            if not self.counts[above].sum() or not self.counts[~above].sum():
                break
            high = float(np.average(values[above], weights=self.counts[above]))
            low = float(np.average(values[~above], weights=self.counts[~above]))
            if not high > low:
                break
            found = (high - low) / np.log(high / low)
            if abs(found - level) < _CLOSE * level:
                break
            level = found
        return level + least

    def half_height(self, *, start: float | None = None) -> float:
        """Return the level half-way between the values inside and outside; NaN if there is none.

        The search begins at `start`, by default Li's threshold. Each step is halved, so that the
        search does not swing between two levels.
        """
        level = self.li_threshold() if start is None else start
        for _ in range(_STEPS):
            inside = self.above(level).quantile(INSIDE)
            outside = self.below(level).quantile(OUTSIDE)
            step = (inside + outside) / 2 - level
            if not np.isfinite(step):
                return np.nan
            level += step / 2
            if abs(step) < _CLOSE * abs(inside - outside):
                break
        return level

    def find_valleys(self, noise: float) -> list[Valley]:
        """Return the gaps between the histogram's peaks, rising.

        noise  sigma of the field's noise at the dark end, voxel values

        On the axis asinh((value - dark) / 2 noise) the peaks of dim and bright voxels have similar
        widths: the axis is linear near the dark end, and logarithmic far from it. A peak counts if
        the histogram falls to DIP of its height on the way to a higher peak.
        """
        values, height = self._smoothed(noise)
        widths = np.gradient(values) if len(values) > 1 else values
        valleys = []
        for left, right in pairwise(_peaks(height)):
            part = height[left : right + 1]
            least = float(part.min())
            # Voxels per step of value: a blurred edge has the same number at every height.
            density = part / widths[left : right + 1]
            flat = left + np.flatnonzero(
                (density <= _FLAT * density.min()) | (part <= _FLAT * least)
            )
            valleys.append(
                Valley(
                    float(values[left + int(part.argmin())]),
                    float(values[flat[0]]),
                    float(values[flat[-1]]),
                    float(values[right]),
                    least / float(min(height[left], height[right])),
                )
            )
        return valleys

    def outline(self, noise: float, points: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the histogram on the stabilised axis: voxel values, and heights scaled to 1."""
        values, height = self._smoothed(noise)
        if not len(height):
            return (), ()
        places = np.unique(np.linspace(0, len(values) - 1, points).round().astype(int))
        height = height[places] / height.max()
        return (
            tuple(float(f"{value:.6g}") for value in values[places]),
            tuple(round(float(share), 5) for share in height),
        )

    def _smoothed(self, noise: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return voxel values and heights on the stabilised axis; empty if all values are equal."""
        nothing = np.zeros(0)
        dark = self.quantile(DARK)
        axis = np.arcsinh((self.edges - dark) / (2 * noise))
        ends = np.array([self.quantile(share) for share in _ENDS])
        low, high = np.arcsinh((ends - dark) / (2 * noise))
        if not high > low:
            return nothing, nothing
        count = int(np.clip((high - low) / _STEP, 50, 3000))
        step = (high - low) / count
        sums = np.interp(np.linspace(low, high, count + 1), axis[1:], np.cumsum(self.counts))
        height = ndimage.gaussian_filter1d(np.diff(sums), _SIGMA / step, mode="nearest")
        return dark + 2 * noise * np.sinh(low + (np.arange(count) + 0.5) * step), height


def _peaks(height: NDArray[np.float64]) -> list[int]:
    """Return the peaks that stand out, rising.

    The lower one of two peaks is removed as long as the gap between them is shallow.
    """
    padded = np.concatenate([[-np.inf], height, [-np.inf]])
    rises, falls = height >= padded[:-2], height > padded[2:]
    peaks = [int(k) for k in np.flatnonzero(rises & falls & (height > 0))]
    while len(peaks) > 1:
        dips = [
            height[left : right + 1].min() / min(height[left], height[right])
            for left, right in pairwise(peaks)
        ]
        worst = int(np.argmax(dips))
        if dips[worst] <= DIP:
            break
        left, right = peaks[worst], peaks[worst + 1]
        peaks.remove(left if height[left] < height[right] else right)
    return peaks
