"""Choose the iso-value of one (tile, channel): the level whose surface follows the most edges.

The coarea formula turns the integrals over the iso-surfaces, area and total gradient, into
histograms over the voxels, so that one pass scores every level. Criteria: the family of Pekar,
Wiemker & Hempel, "Fast detection of meaningful isosurfaces for volume data visualization", IEEE
Visualization 2001: area, total gradient, mean gradient (total / area), and between them total /
sqrt(area). As stated they fail on real stacks: the mean climbs with brightness and cuts only the
cores of the brightest cells, the total floods the noise.

The default, `edges`, lets only what is steeper than noise count: a voxel's weight is 1 - n / g^2,
where g is its gradient and n NOISE_FACTOR times the mean square gradient of the tile's dim part.
The total of that says where the edges are, for bodies of any brightness; on its summit, total /
sqrt(area) settles the level. Over 144 tiles of balls, tubes and membranes (1 to 40 % of the tile,
alike or 1 to 8 times as bright, 10 to 200 photons, even and uneven background; `make bench-iso`)
its solids have a mean Dice of .732 with the truth; total / sqrt(area) .680, mean .610, total .608,
area .403; Otsu .658, isodata .643, Li .641 on the smoothed voxels, .678, .665, .654 on the same
denoised field above its background.

That last step keeps the volume of a blurred ball, where half the height, the steepest level and the
total's own peak do not: r f(r) is a blur in one dimension, so that |f'| r, which is total /
sqrt(area) over the level of radius r, peaks at the true radius R but for s^4 / R^3 (s the blur's
sigma). Half the height and the mean's peak lie s^2 / R further in, the total's as far out, where
3 s^2 / R^2 of the volume are missing or too much.

A tile's confidence is (1 - 1 / sharpness) x (1 - raggedness): how much steeper the field is at the
level than elsewhere in the tile, and how much of the surface stays when it is smoothed once more
(isosurface/raggedness.py). isosurface/neighbour_consensus.py lets the neighbours weaken it. The
bound `min_confidence`, .4, by this evidence: cells of a real light-sheet stack .77 and .49 (its
bright and its dark part), the autofluorescence in its other channel .34 and .15; stained tiles of
the synthetic block .57 to .99, those without the stain .02 to .13; noise without structure, white,
blurred, rising or log-normal, .00 to .21. Of the 144 tiles above 118 reach it: none of the 5 whose
solids have a Dice below .3, all but 6 of the 67 with a Dice above .8 (packed membranes and tubes,
of few photons).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.distance_field import gradient_magnitude
from stereocell.isosurface.options import IsoValueOptions
from stereocell.isosurface.raggedness import find_raggedness
from stereocell.model.errors import NoSurfaceError

NOISE_FACTOR = 8.0  # noise's own gradients rarely reach it; 3 to 16 choose alike
DIM_PERCENTILE = 40.0  # of the voxels: taken as free of edges, where the noise is measured
CHI = 0.789  # median over mean of a chi-square of three: of noise's squared gradient
EDGES_SHARE = 0.70  # of the most edges: levels that follow nearly as many are in the choice
PEAK_SHARE = 0.75  # of the best score: the summit of the curve, to which a parabola is fitted


@dataclass(frozen=True, slots=True)
class IsoValue:
    """An iso-value with the evidence for it.

    value       in the units of the voxels
    sharpness   mean gradient at the level over the median gradient of the tile. In noise without
                structure all levels are alike and it is near 1
    raggedness  share of the surface that goes when the field is smoothed once more, 0..1
    strength    total gradient over the surface, less what noise makes of it: voxel values x um;
                how much this tile says of its channel
    levels, score  the criterion's curve, float64 (bins,); score is scaled to a maximum of 1
    """

    value: float
    sharpness: float
    raggedness: float
    strength: float
    levels: NDArray[np.float64]
    score: NDArray[np.float64]

    @property
    def confidence(self) -> float:
        """The evidence that there is a surface at the value: 0 in noise, towards 1 as it grows."""
        return max(0.0, 1.0 - 1.0 / self.sharpness) * (1.0 - self.raggedness)


def find_iso_value(
    field: NDArray[np.float32], spacing_um: tuple[float, float, float], options: IsoValueOptions
) -> IsoValue:
    """Return the iso-value of a smoothed field (z, y, x).

    Raises NoSurfaceError if all voxels are equal, or if no level separates anything.
    """
    low = float(field.min())
    dim, high = (float(v) for v in np.percentile(field, [DIM_PERCENTILE, options.clip_percentile]))
    if not high > low:
        raise NoSurfaceError(f"every voxel is {low:g}")
    # in heights of the range per um: voxels may be so large that their squares leave float32
    gradient = gradient_magnitude(field, spacing_um)
    gradient /= np.float32(high - low)
    weights = gradient
    if options.curve == "edges":
        noise = NOISE_FACTOR / CHI * float(np.median(gradient[field <= dim])) ** 2
        tiny = np.float32(1e-12)
        weights = gradient * np.maximum(0, 1 - noise / np.maximum(gradient**2, tiny))
    span = (low, high)
    area, edges = np.histogram(field, options.bins, span, weights=weights)
    total, _ = np.histogram(field, options.bins, span, weights=weights * gradient)
    slope, _ = np.histogram(field, options.bins, span, weights=gradient)
    count, _ = np.histogram(field, options.bins, span)
    levels = (edges[:-1] + edges[1:]) / 2

    # single bins are noisy where few voxels fall. On six synthetic tiles a sigma of 1 % of the
    # levels put the peak up to 15 % off the boundary's intensity, 3 % at most 10 %
    area, total, slope, count = (
        ndimage.gaussian_filter1d(h.astype(np.float64), 0.03 * options.bins)
        for h in (area, total, slope, count)
    )
    score = _score(area, total, options)
    if not score.max() > 0:
        raise NoSurfaceError("no level separates anything")
    score = score / score.max()
    best = int(score.argmax())
    # a tile without any noise has a median of 0: the tiniest slope keeps the ratio finite
    usual = max(float(np.median(gradient)), 1e-6)
    sharpness = float(slope[best] / max(count[best], 1e-9)) / usual
    # by the coarea formula: the sum of g^2 over a bin's voxels is the bin's width x the integral
    # of g over the surface
    voxel = float(np.prod(spacing_um))
    strength = float(total[best]) * voxel * options.bins * (high - low)
    value = _peak(levels, score, best)
    raggedness = find_raggedness(field, value, spacing_um)
    return IsoValue(value, sharpness, raggedness, strength, levels, score)


def _score(
    area: NDArray[np.float64], total: NDArray[np.float64], options: IsoValueOptions
) -> NDArray[np.float64]:
    """Return the criterion over the levels; 0 for those that are out of the choice."""
    large = (area > 0) & (area >= options.min_area_share * area.max())
    if options.curve == "pekar-area":
        return np.where(large, area, 0.0)
    exponent = {"pekar-total": 0.0, "pekar-mean": 1.0}.get(options.curve, 0.5)
    score = np.where(large, total / np.where(large, area, 1.0) ** exponent, 0.0)
    if options.curve == "edges":
        score = np.where(total >= EDGES_SHARE * total.max(), score, 0.0)
    return score


def _peak(levels: NDArray[np.float64], score: NDArray[np.float64], best: int) -> float:
    """Return the top of the parabola fitted to the curve's summit, which holds the best level.

    The summit is what lies above PEAK_SHARE without a break; weights fall to 0 at its foot. The top
    is broad and the histograms are noisy, a tile with one small body having few voxels on its edge:
    the single best level strays by a tenth of the body's height.
    """
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
