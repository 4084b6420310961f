"""What one tile tells about its channel's level: histograms, slopes at each value, noise, padding.

Every number is a sum over voxels, so that tiles, in any cut, add up to the whole dataset.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.filters.denoise import MEDIAN_REACH, SMOOTHING_REACH
from stereocell.isosurface.distance_field import gradient_magnitude
from stereocell.isosurface.level_histogram import BINS, Scale

LAG = 4  # voxels along x between the two values whose difference is noise: beyond the denoising
HALO = (1, 1, LAG)  # voxels (z, y, x) around a tile that its evidence reads
NOISE_BINS = 1024
Slices = tuple[slice, slice, slice]
_NOISE_LEAST = 1e-6  # share of the scale's range: the first bin of differences


@dataclass(frozen=True, slots=True)
class Sums:
    """Sums over a tile's voxels in the bins of a scale, but for its padding.

    counts  int64 (BINS,), voxels
    slopes  float64 (BINS,), gradient magnitudes, voxel values per um
    """

    counts: NDArray[np.int64]
    slopes: NDArray[np.float64]

    def __add__(self, other: "Sums") -> "Sums":
        return Sums(self.counts + other.counts, self.slopes + other.slopes)


@dataclass(frozen=True, slots=True)
class TileEvidence:
    """One tile's part of what its channel's level is found on.

    plain        of the denoised field
    padding      of its padding, in the same field
    above        of the field above the background; None: the channel has none
    differences  int64 (NOISE_BINS,), how often the field differs by so much LAG voxels further
    """

    plain: Sums
    padding: Sums
    above: Sums | None
    differences: NDArray[np.int64]


def denoising_reach(
    sigma_um: float, spacing_um: tuple[float, float, float]
) -> tuple[int, int, int]:
    """Return how many voxels (z, y, x) away a denoised voxel depends on others."""
    z, y, x = (int(np.ceil(SMOOTHING_REACH * sigma_um / step)) for step in spacing_um)
    return z, y + MEDIAN_REACH, x + MEDIAN_REACH


def find_padding(
    voxels: NDArray[Any], darkest: float, reach: tuple[int, int, int]
) -> NDArray[np.bool_]:
    """Return which voxels are padding, or so near to it that denoising mixes them, bool (z, y, x).

    voxels   (z, y, x), as read
    darkest  the channel's least value
    reach    voxels (z, y, x) that denoising reaches

    Padding are runs of the darkest value as long as the reach on both sides in plane: a stitched
    mosaic's corners, a scanner's circle, a border. Single dark voxels of a noisy dark end are none.
    """
    dark = voxels == darkest
    if not dark.any():
        return dark
    size = (1, *(min(2 * r + 1, n) for r, n in zip(reach[1:], voxels.shape[1:], strict=True)))
    flat = ndimage.minimum_filter(dark.view(np.uint8), size, mode="nearest")
    if not flat.any():
        return flat.view(bool)
    # back to the run's own ends, and on to where it is mixed with what lies beside it
    wide = tuple(4 * r + 1 if axis else 2 * r + 1 for axis, r in enumerate(reach))
    return ndimage.maximum_filter(flat, wide, mode="nearest").view(bool)


def gather_evidence(
    field: NDArray[np.float32],
    padding: NDArray[np.bool_],
    own: Slices,
    *,
    spacing_um: tuple[float, float, float],
    scale: Scale,
    background: NDArray[np.float32] | None = None,
    scale_above: Scale | None = None,
) -> TileEvidence:
    """Return a tile's evidence.

    field        denoised, float32 (z, y, x), voxel values, of a window around the tile: HALO voxels
                 more each way, where the data has them
    padding      bool, the same window, as `find_padding` returns it
    own          the tile in the window
    spacing_um   (z, y, x)
    scale        of the channel's values, the same for all its tiles
    background   float32, broadcasts over the window, voxel values; None: none is tried
    scale_above  of the values above the background

    With the halo, the sums over all tiles are those of the whole dataset, however it is cut.
    """
    kept = ~padding[own]
    above = None
    if background is not None and scale_above is not None:
        above = _sums(field - background, own, kept, spacing_um, scale_above)
    slopes = gradient_magnitude(field, spacing_um)[own]
    bins = scale.bins_of(field[own])
    return TileEvidence(
        _binned(bins[kept], slopes[kept]),
        _binned(bins[~kept], slopes[~kept]),
        above,
        _differences(field, padding, own, scale),
    )


def _sums(
    field: NDArray[np.float32],
    own: Slices,
    kept: NDArray[np.bool_],
    spacing_um: tuple[float, float, float],
    scale: Scale,
) -> Sums:
    slopes = gradient_magnitude(field, spacing_um)[own]
    return _binned(scale.bins_of(field[own])[kept], slopes[kept])


def _binned(bins: NDArray[np.int16], slopes: NDArray[np.float32]) -> Sums:
    counts = np.bincount(bins, minlength=BINS).astype(np.int64)
    summed = np.bincount(bins, weights=slopes, minlength=BINS).astype(np.float64)
    return Sums(counts, summed)


def _differences(
    field: NDArray[np.float32], padding: NDArray[np.bool_], own: Slices, scale: Scale
) -> NDArray[np.int64]:
    start, stop = own[2].start, min(own[2].stop, field.shape[2] - LAG)
    if stop <= start:
        return np.zeros(NOISE_BINS, np.int64)
    here, there = (*own[:2], slice(start, stop)), (*own[:2], slice(start + LAG, stop + LAG))
    size = np.abs(field[there] - field[here])[~(padding[there] | padding[here])]
    edges = noise_edges(scale)
    return np.asarray(np.histogram(np.clip(size, edges[0], edges[-1]), edges)[0], np.int64)


def noise_edges(scale: Scale) -> NDArray[np.float64]:
    """Return the ends of the bins of differences, float64 (NOISE_BINS + 1,), voxel values.

    The first begins at 0, and the others grow by the same factor.
    """
    edges = (scale.high - scale.low) * np.geomspace(_NOISE_LEAST, 1.0, NOISE_BINS + 1)
    edges[0] = 0.0
    return np.asarray(edges, np.float64)
