"""A histogram of field values that many tiles add up to, and the levels that it shows.

Its bins are narrow near the channel's usual values and grow with the distance beyond (even in the
inverse hyperbolic sine of the value): a few voxels of 60 000 leave the difference of 100 and 110
visible. Counts are whole numbers, so that their sum over the tiles is the same in any order.

References
C. H. Li & P. K. S. Tam, "An iterative algorithm for minimum cross entropy thresholding", Pattern
Recognition Letters 19, 1998. doi:10.1016/S0167-8655(98)00057-9
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.model.lattice_field import LatticeField

BINS = 4096
INSIDE = 0.6  # quantile of the voxels above a level that is the height of the bodies
OUTSIDE = 0.5  # quantile of the voxels below it that is the height of what surrounds them
DARK = 0.05  # quantile that is the dark end, from which distances are measured in noise
_LOWEST_QUANTILE = 0.001  # quantile that Li's threshold counts from: it wants values above 0
_FINE = 1 << 16  # even bins that values are put into first: faster than a hyperbolic sine of each
_SPREAD = 90.0  # range over the distance from the middle at which bins begin to grow
_STEPS = 200
_CLOSE = 1e-4  # share of the contrast; a smaller step ends a search
_STEP = 0.02  # step of the stabilised axis; its unit is twice the noise at the dark end
_SIGMA = 0.15  # smoothing along that axis
DIP = 0.7  # largest height of a valley, as a share of the lower of its two peaks
_FLAT = 1.5  # multiple of a valley's least height up to which it is a valley
_ENDS = (0.0002, 0.9999)  # quantiles between which peaks are looked for


@dataclass(frozen=True, slots=True)
class Scale:
    """Where the bins lie, in voxel values: from `low` to `high`, narrowest at `middle`."""

    low: float
    high: float
    middle: float

    @classmethod
    def of(cls, voxels: NDArray[Any], padding: NDArray[np.bool_]) -> "Scale":
        """Return the scale for fields whose voxels these represent, any shape, any number type.

        padding  bool, the same shape; the middle is that of the others

        The field is smoother than its voxels, so nearly all of it lies within their range; a few
        hot voxels lie beyond, and count at the end.
        """
        low, high = (float(v) for v in np.percentile(voxels, (0.001, 99.999)))
        middle = float(np.median(voxels[~padding] if padding.any() else voxels))
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
        """Return each value's bin, int16 of the same shape; a value beyond an end counts there."""
        table, step = self.table()
        place = values - np.float32(self.low)
        place /= np.float32(step)
        np.clip(place, 0, _FINE - 1, out=place)
        return table[place.astype(np.uint16)]

    def table(self) -> tuple[NDArray[np.int16], float]:
        """Return the bin of each even step from `low` on, int16, and the step, voxel values."""
        step = (self.high - self.low) / _FINE
        fine = self.low + (np.arange(_FINE) + 0.5) * step
        table = np.clip(np.searchsorted(self.edges(), fine, "right") - 1, 0, BINS - 1)
        return table.astype(np.int16), step


@dataclass(frozen=True, slots=True)
class Valley:
    """A gap between two peaks, in voxel values.

    value       where it is lowest
    low, high   where it ends: beyond, the histogram rises
    peak        the upper of its two peaks
    dip         its least height as a share of the lower peak, 0..1
    """

    value: float
    low: float
    high: float
    peak: float
    dip: float


@dataclass(frozen=True)
class LevelHistogram:
    """Voxel counts, float64 (BINS,), in bins with these ends, float64 (BINS + 1,), voxel values."""

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
        """Return the histogram of the voxels above `low` and up to `high` alone."""
        kept = (self.centres > low) & (self.centres <= high)
        return LevelHistogram(np.where(kept, self.counts, 0.0), self.edges)

    def above(self, level: float) -> "LevelHistogram":
        """Return the histogram of the voxels above a level alone."""
        return self.between(level, np.inf)

    def below(self, level: float) -> "LevelHistogram":
        """Return the histogram of the voxels at or below a level alone."""
        return self.between(-np.inf, level)

    def quantile(self, share: float) -> float:
        """Return the value that `share` (0..1) of the voxels lie below; NaN without a voxel."""
        sums = np.cumsum(self.counts)
        return float(np.interp(share * sums[-1], sums, self.centres)) if sums[-1] else np.nan

    def width_at(self, value: float) -> float:
        """Return the width of the bin that a value lies in, in voxel values."""
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
        """Return the level half-way between what it has inside and outside; NaN where none has.

        The search begins at `start`, by default Li's threshold. Each step goes half of the way, so
        that it doesn't swing between two levels.
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

        Along the axis asinh((value - dark) / 2 noise) the peaks of dim and of bright voxels are of
        like width: near the dark end it is even, far from it a logarithm. A peak counts where the
        histogram falls to DIP of it on the way to a higher one.
        """
        values, height = self._smoothed(noise)
        widths = np.gradient(values) if len(values) > 1 else values
        valleys = []
        for left, right in pairwise(_peaks(height)):
            part = height[left : right + 1]
            least = float(part.min())
            # by voxels a step of value: a blurred edge has as many at every height
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
        """Return the histogram along that axis for a chart: voxel values, and heights up to 1."""
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
        """Return voxel values and smoothed heights along that axis; empty where it is none."""
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
    """Return the peaks that stand out, rising; the least of a pair goes while their gap is flat."""
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
