"""Choose a channel's level by the edges that its surface would follow.

By the coarea formula the integrals over the iso-surfaces, area and total gradient, become
histograms over the voxels. So one pass scores every level, and the tiles' histograms add up to the
channel's.

The criteria are those of Pekar, Wiemker & Hempel: area, total gradient and mean gradient (total /
area), and between them total / sqrt(area). As published they fail on real stacks. The mean grows
with brightness and cuts only the cores of the brightest cells. The total follows the noise.

`edges` counts only gradients steeper than noise. The weight of a voxel is 1 - n / g^2, where g is
its gradient and n is NOISE_FACTOR times the mean square gradient of the tile's dim part. The
weighted total finds the edges of bodies of any brightness. Among the levels near its maximum,
total / sqrt(area) chooses one. This last choice keeps the volume of a blurred ball, where r f(r) is
a blur in one dimension. At a level of radius r, total / sqrt(area) is |f'| r. This has its maximum
at the true radius R, except for an error of s^4 / R^3, where s is the blur's sigma.

References
V. Pekar, R. Wiemker & D. Hempel, "Fast detection of meaningful isosurfaces for volume data
visualization", IEEE Visualization 2001. doi:10.1109/VISUAL.2001.964515
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.level_histogram import BINS, LevelHistogram, Scale
from stereocell.isosurface.options import CRITERIA, Criterion, IsoValueOptions

# Multiple of the noise's mean g^2 that edges exceed; 3 to 16 choose the same levels
NOISE_FACTOR = 8.0
# Percent of the voxels, dimmest first: noise is measured there, because they have no edges
DIM_PERCENTILE = 40.0
# Median / mean of a chi-square distribution of 3 degrees: the squared gradient of noise
CHI = 0.789
EDGES_SHARE = 0.70  # share of the largest total, 0..1, that a level needs to be chosen
PEAK_SHARE = 0.75  # share of the best score, 0..1; a parabola is fitted to the scores above it
# Sigma of the Gaussian over the levels, as a share of their number. Each level sums a bin of voxel
# values, and a bin with few voxels is noisy.
_SMOOTHING = 0.03


@dataclass(frozen=True, slots=True)
class EdgeSums:
    """Sums over a tile's voxels in the bins of a scale.

    areas   float64 (BINS,), sums of the gradient magnitudes: the surface's area at each level
    totals  float64 (BINS,), sums of their squares: the total gradient over that surface
    """

    areas: NDArray[np.float64]
    totals: NDArray[np.float64]

    def __add__(self, other: "EdgeSums") -> "EdgeSums":
        return EdgeSums(self.areas + other.areas, self.totals + other.totals)


def gather_edges(
    field: NDArray[np.float32],
    slopes: NDArray[np.float32],
    *,
    scale: Scale,
    criterion: Criterion,
) -> EdgeSums:
    """Return a tile's sums over the voxels that are counted.

    field   float32, any shape: voxel values
    slopes  float32, the same shape: their gradient magnitudes, voxel values per um
    """
    if not field.size:
        return EdgeSums(np.zeros(BINS), np.zeros(BINS))
    # The unit is the values' range per um, because squares of large voxel values overflow float32.
    slopes = slopes / np.float32(scale.high - scale.low)
    weights = slopes
    if criterion.discounts_noise:
        dim = float(np.percentile(field, DIM_PERCENTILE))
        noise = NOISE_FACTOR / CHI * float(np.median(slopes[field <= dim])) ** 2
        tiny = np.float32(1e-12)
        weights = slopes * np.maximum(0, 1 - noise / np.maximum(slopes**2, tiny))
    bins = scale.bins_of(field).ravel()
    areas = np.bincount(bins, weights=weights.ravel(), minlength=BINS)
    totals = np.bincount(bins, weights=(weights * slopes).ravel(), minlength=BINS)
    return EdgeSums(areas.astype(np.float64), totals.astype(np.float64))


def choose_by_edges(
    sums: EdgeSums, histogram: LevelHistogram, *, options: IsoValueOptions
) -> float | None:
    """Return the level of the largest score, in voxel values; None if no level separates anything.

    histogram  of the voxels of `sums`, in the same bins
    """
    criterion = CRITERIA[options.criterion]
    low, high = histogram.quantile(0.0), histogram.quantile(options.clip_percentile / 100)
    if not high > low:
        return None
    edges = np.linspace(low, high, options.bins + 1)
    area, total = (
        # The levels are even, so their density needs no division by the widths of the scale's bins.
        ndimage.gaussian_filter1d(
            np.diff(np.interp(edges, histogram.edges[1:], np.cumsum(values))),
            _SMOOTHING * options.bins,
        )
        for values in (sums.areas, sums.totals)
    )
    large = (area > 0) & (area >= options.min_area_share * area.max())
    score = np.where(large, criterion.score(total, np.where(large, area, 1.0)), 0.0)
    if criterion.discounts_noise:
        score = np.where(total >= EDGES_SHARE * total.max(), score, 0.0)
    if not score.max() > 0:
        return None
    return find_peak((edges[1:] + edges[:-1]) / 2, score / score.max())


def find_peak(levels: NDArray[np.float64], score: NDArray[np.float64]) -> float:
    """Return the top of the parabola that is fitted to the curve around the best level.

    levels  evenly spaced, voxel values
    score   of each level; the largest is 1

    The fit takes the unbroken run of levels around the best whose scores are above PEAK_SHARE. The
    weights fall to 0 at its ends. The single best level would be off by up to a tenth of the body's
    height: the peak is broad, and the histograms are noisy, since a small body has few voxels on
    its edge. On a tile of nuclei the best level moved by 2.5 % if every second row was counted, and
    the top of the parabola by .2 %.
    """
    best = int(score.argmax())
    low = np.flatnonzero(score < PEAK_SHARE)
    end = int(np.searchsorted(low, best))
    first = int(low[end - 1]) + 1 if end > 0 else 0
    stop = int(low[end]) if end < len(low) else len(score)
    if stop - first < 5:
        return float(levels[best])
    place = np.arange(first, stop) - best
    weights = np.sqrt(score[first:stop] - PEAK_SHARE)
    square, linear, _ = np.polyfit(place, score[first:stop], 2, w=weights)
    shift = -linear / (2 * square) if square < 0 else 0.0
    return float(levels[best] + np.clip(shift, place[0], place[-1]) * (levels[1] - levels[0]))
