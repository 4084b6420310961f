"""Gather one tile's evidence for its channel's levels: histograms, slopes, noise and padding.

Every number is a sum over voxels, so the sums of all tiles are those of the dataset in any cut.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.filters.boxes import dilate, erode
from stereocell.filters.reach import SMOOTHING_REACH, median_reach
from stereocell.isosurface.axis_profiles import Profiles
from stereocell.isosurface.distance_field import gradient_magnitude
from stereocell.isosurface.edge_criteria import EdgeSums, gather_edges
from stereocell.isosurface.level_histogram import BINS, Scale
from stereocell.isosurface.neighbours import Neighbours
from stereocell.isosurface.options import Criterion
from stereocell.kernels.level_sums import count_differences, sum_by_value
from stereocell.model.spacing import Spacing

MAX_PADDING = 0.8  # share of the voxels; padding that covers more is ground without noise
# Voxels along a row of an image between two values whose difference counts as noise: more than
# denoising reaches
LAG = 4
HALO = (1, 1, LAG)  # voxels (slice, row, column) around a tile that its evidence reads
NOISE_BINS = 1024
_PLANES = 16  # number of planes that are counted together
_AT_ONCE = 1 << 18  # voxels in which padding is found together; they fit into a processor's cache
_FINITE = 255 << 7  # upper 16 bits of the first float32 that is not finite
Slices = tuple[slice, slice, slice]
# Returns the background, float32 (slice, row, column), of a window's slices from one to another. It
# broadcasts over them.
Background = Callable[[int, int], NDArray[np.float32]]
_NOISE_LEAST = 1e-6  # share of the scale's range: end of the first bin of differences


@dataclass(frozen=True, slots=True)
class Sums:
    """Sums over a tile's voxels in the bins of a scale. Padding is left out.

    counts   int64 (BINS,), numbers of voxels
    slopes   float64 (BINS,), sums of gradient magnitudes, voxel values per um
    squares  float64 (BINS,), sums of squared gradients as shares of the scale's range, per um^2
    """

    counts: NDArray[np.int64]
    slopes: NDArray[np.float64]
    squares: NDArray[np.float64]

    def __add__(self, other: "Sums") -> "Sums":
        return Sums(
            self.counts + other.counts, self.slopes + other.slopes, self.squares + other.squares
        )


@dataclass(frozen=True, slots=True)
class TileEvidence:
    """One tile's part of the evidence for its channel's levels.

    plain        sums of the denoised field
    padding      sums of the denoised field over the padding
    above        sums of the field above the background; None: the channel has no background
    differences  int64 (NOISE_BINS,), counts of differences between voxels LAG apart along a row
    profiles     sums along the axes, of the field and of the field above the background
    neighbours   sums over neighbouring voxels as read
    edges        sums for scoring edges, of the field and of the field above the background; None:
                 no criterion scores edges
    """

    plain: Sums
    padding: Sums
    above: Sums | None
    differences: NDArray[np.int64]
    profiles: tuple[Profiles, Profiles | None] | None = None
    neighbours: Neighbours | None = None
    edges: tuple[EdgeSums, EdgeSums | None] | None = None

    def followed_by(self, other: "TileEvidence") -> "TileEvidence":
        """Return a tile's evidence from that of its first slices and of all others.

        Edges are left out.
        """
        assert self.profiles is not None
        assert other.profiles is not None
        assert self.neighbours is not None
        assert other.neighbours is not None
        (first, above), (next_one, next_above) = self.profiles, other.profiles
        return TileEvidence(
            self.plain + other.plain,
            self.padding + other.padding,
            self.above + other.above if self.above and other.above else None,
            self.differences + other.differences,
            (
                first.followed_by(next_one),
                above.followed_by(next_above) if above and next_above else None,
            ),
            self.neighbours + other.neighbours,
        )


@dataclass(frozen=True, slots=True)
class Counting:
    """The scales by which all tiles of a channel are counted.

    scale        for the values
    scale_above  for the values above the background; None: no background is tried
    darkest      the channel's least value, which is that of its padding; None: no padding
    mask         the channel's two values if it has only two; None: it has more
    """

    scale: Scale
    scale_above: Scale | None
    darkest: float | None
    mask: tuple[float, float] | None = None


def denoising_reach(sigma_um: float, spacing_um: Spacing, slice_axis: int) -> tuple[int, int, int]:
    """Return how many voxels (z, y, x) away a denoised voxel depends on others."""
    medians = median_reach(spacing_um, slice_axis)
    z, y, x = (
        int(np.ceil(SMOOTHING_REACH * sigma_um / step)) + median
        for step, median in zip(spacing_um, medians, strict=True)
    )
    return z, y, x


def find_padding(
    voxels: NDArray[Any], darkest: float | None, reach: tuple[int, int, int]
) -> NDArray[np.bool_]:
    """Return the voxels that are padding, or that denoising mixes with padding, as a mask (bool).

    voxels   (slice, row, column), as read; the mask has the same axes
    darkest  the channel's least value; None: the channel has no padding
    reach    voxels (slice, row, column) that denoising reaches

    Padding consists of runs of the darkest value that extend as far as the reach on both sides in
    plane: corners of a stitched mosaic, a scanner's circle, a border. Single dark voxels at the
    dark end of noise are not padding.
    """
    dark = np.zeros(voxels.shape, bool) if darkest is None else voxels == darkest
    if not dark.any():
        return dark
    size = (1, *(min(2 * r + 1, n) for r, n in zip(reach[1:], voxels.shape[1:], strict=True)))
    # At the end of a row a run of half the size is enough
    if not any(_has_run(plane, (size[2] + 1) // 2) for plane in dark):
        return np.zeros(voxels.shape, bool)
    before = tuple(n // 2 for n in size)
    after = tuple(n - 1 - k for n, k in zip(size, before, strict=True))
    found, planes = np.zeros(voxels.shape, bool), max(1, _AT_ONCE // dark[0].size)
    for start in range(0, len(dark), planes):
        part = slice(start, start + planes)
        flat = erode(dark[part], before, after)
        if flat.any():
            # Grow back to the run's own ends, and further to where denoising mixes it with its
            # surroundings.
            found[part] = dilate(flat, (0, 2 * reach[1], 2 * reach[2]))
    return dilate(found, (reach[0], 0, 0))


def _has_run(flags: NDArray[np.bool_], length: int) -> bool:
    """Return whether `length` flags (row, column) are set side by side along a row."""
    known = 1
    while known < length and flags.any():
        onward = min(known, length - known)
        flags, known = flags[:, :-onward] & flags[:, onward:], known + onward
    return bool(flags.any())


def gather_evidence(
    field: NDArray[np.float32],
    padding: NDArray[np.bool_],
    own: Slices,
    *,
    voxels: NDArray[Any],
    spacing_um: Spacing,
    counting: Counting,
    start: tuple[int, int, int] = (0, 0, 0),
    background: Background | None = None,
    criterion: Criterion | None = None,
) -> TileEvidence:
    """Return a tile's evidence.

    All axes are (slice, row, column), as `slices_first` returns them.

    field        denoised, float32, voxel values, of a window around the tile: HALO voxels more on
                 each side, where the data has them
    padding      bool, the same window, as `find_padding` returns it
    own          the tile within the window
    voxels       as read, the same window
    spacing_um   of the three axes
    counting     scales of the channel
    start        index (slice, row, column) of the tile's first voxel in the dataset
    background   of the window's slices, voxel values; None: no background is tried
    criterion    the criterion that scores edges; None: levels follow from histograms

    With the halo, the sums over all tiles are those of the dataset, however it is cut.
    """
    parts = []
    z0, z1 = own[0].start, own[0].stop
    # Limits the memory: the field above the background is as large as the field
    for z in range(z0, z1, _PLANES):
        low, high = max(z - HALO[0], 0), min(z + _PLANES + HALO[0], len(field))
        inner = (slice(z - low, min(z + _PLANES, z1) - low), *own[1:])
        raised = None
        if background is not None and counting.scale_above is not None:
            raised = field[low:high] - background(low, high)
        window = _Window(field[low:high], raised, padding[low:high], voxels[low:high])
        at = (start[0] + z - z0, *start[1:])
        parts.append(_gather(window, inner, spacing_um, counting, at))
    found = reduce(TileEvidence.followed_by, parts)
    if criterion is None:
        return found
    edges = _edges(field, padding, own, spacing_um, counting.scale, criterion)
    above = None
    if background is not None and counting.scale_above is not None:
        raised = field - background(0, len(field))
        above = _edges(raised, padding, own, spacing_um, counting.scale_above, criterion)
    return replace(found, edges=(edges, above))


@dataclass(frozen=True, slots=True)
class _Window:
    """A window around some slices of a tile. All arrays have the same shape.

    raised  the field above the background; None: no background is tried
    """

    field: NDArray[np.float32]
    raised: NDArray[np.float32] | None
    padding: NDArray[np.bool_]
    voxels: NDArray[Any]


def _gather(
    window: _Window,
    own: Slices,
    spacing_um: Spacing,
    counting: Counting,
    start: tuple[int, int, int],
) -> TileEvidence:
    field, padding, scale = window.field, window.padding, counting.scale
    plain, out = _binned(field, padding, own, spacing_um, scale)
    above = along = None
    if window.raised is not None and counting.scale_above is not None:
        above, _ = _binned(window.raised, padding, own, spacing_um, counting.scale_above)
        along = Profiles.of(window.raised, padding, own, start)
    ends = scale.low, scale.middle, scale.high
    return TileEvidence(
        plain,
        out,
        above,
        _differences(field, padding, own, scale),
        (Profiles.of(field, padding, own, start), along),
        Neighbours.of(window.voxels, padding, own, ends),
    )


def _edges(
    field: NDArray[np.float32],
    padding: NDArray[np.bool_],
    own: Slices,
    spacing_um: Spacing,
    scale: Scale,
    criterion: Criterion,
) -> EdgeSums:
    kept = ~padding[own]
    slopes = gradient_magnitude(field, spacing_um)[own]
    return gather_edges(field[own][kept], slopes[kept], scale=scale, criterion=criterion)


def _binned(
    field: NDArray[np.float32],
    padding: NDArray[np.bool_],
    own: Slices,
    spacing_um: Spacing,
    scale: Scale,
) -> tuple[Sums, Sums]:
    """Return the sums over the voxels that are not padding, and over those that are."""
    table, step = scale.table()
    # Unit of the slopes, because squares of large values overflow float32
    span = np.float32(scale.high - scale.low)
    kept, out = sum_by_value(
        field,
        padding,
        _box_of(own),
        np.array(spacing_um, np.float64),
        table,
        np.float32(scale.low),
        np.float32(step),
        span,
        BINS,
    )
    return _to_sums(kept), _to_sums(out)


def _to_sums(sums: NDArray[np.float64]) -> Sums:
    return Sums(sums[:, 0].astype(np.int64), sums[:, 1].copy(), sums[:, 2].copy())


def _differences(
    field: NDArray[np.float32], padding: NDArray[np.bool_], own: Slices, scale: Scale
) -> NDArray[np.int64]:
    first, edges = _noise_bins(scale)
    return count_differences(field, padding, _box_of(own), LAG, first, edges)


@lru_cache(maxsize=4)  # one channel's blocks are counted one after another
def _noise_bins(scale: Scale) -> tuple[NDArray[np.int16], NDArray[np.float64]]:
    """Return the first bin of differences with the same upper 16 bits, and the ends of the bins."""
    edges = noise_edges(scale)
    least = (np.arange(_FINITE, dtype=np.uint32) << 16).view(np.float32).astype(np.float64)
    first = np.full(1 << 16, NOISE_BINS - 1, np.int16)
    first[:_FINITE] = np.clip(np.searchsorted(edges, least, "right") - 1, 0, NOISE_BINS - 1)
    return first, edges


def _box_of(own: Slices) -> NDArray[np.int64]:
    return np.array([[part.start, part.stop] for part in own], np.int64)


def noise_edges(scale: Scale) -> NDArray[np.float64]:
    """Return the ends of the bins of differences, float64 (NOISE_BINS + 1,), voxel values.

    The first bin begins at 0, and the others grow by a constant factor.
    """
    edges = (scale.high - scale.low) * np.geomspace(_NOISE_LEAST, 1.0, NOISE_BINS + 1)
    edges[0] = 0.0
    return np.asarray(edges, np.float64)
