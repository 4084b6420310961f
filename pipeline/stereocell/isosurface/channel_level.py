"""Find the levels of a channel's surfaces on what the whole dataset holds: one for all its tiles.

The levels form a ladder, the outermost first: air and skin, skin and bone; ground and tissue,
tissue and cells. Each is found on histograms that the tiles add up to, so that the cut into tiles
changes nothing.

- Where the histogram has a valley between two peaks, the level lies half-way between the upper peak
  and the median of what is darker, as far as the valley reaches.
- Above the last valley there are no more peaks, as where bodies are small or of every brightness.
  There a level begins at Li's threshold and moves until it lies half-way between what it has inside
  and outside, since a blurred edge has its place there. The same again on the voxels above it finds
  the next one.

A level is clear where what is inside differs from what is outside by several times the noise,
where voxels at the level lie on slopes and not in flat noise, and where it separates two groups of
voxels better than a level can in noise or in texture without an end: by a valley, or by the share
of the variance that lies between the groups (Otsu's criterion). At half height that share is .64 in
a normal distribution, .66 to .69 in gamma, log-normal, Pareto and exponential ones, and in every
tail of them; .74 in an even one. The channel's surface is the first clear level; without one it has
none.

A smooth background is subtracted where the field alone shows no valley and edges above the
background are steeper, and never of CT or MR, whose values mean something as they are. Padding,
runs of a darkest value that nothing else comes near, takes no part; in MR it is air.

Measured on the volumes of `make bench-iso`; see docs/decisions.md.

References
N. Otsu, IEEE Trans. Systems, Man, and Cybernetics 9, 1979. doi:10.1109/TSMC.1979.4310076
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from stereocell.isosurface.level_evidence import Sums, TileEvidence, noise_edges
from stereocell.isosurface.level_histogram import DIP, INSIDE, OUTSIDE, LevelHistogram, Scale

LEAST_SNR = 3.0  # contrast over noise of a clear level
LEAST_SHARPNESS = 0.04  # share of the contrast that the finest spacing crosses at a clear level
LEAST_SEPARATION = 0.70  # share of the variance between the groups at a level in no valley
# ... or a little less where edges are as steep and as high as in no texture
WEAKER = {"separation": 0.66, "sharpness": 0.12, "snr": 6.0}
LEAST_CONTRAST = 0.1  # share of the values' range: what a valley's level parts is more than this
BACKGROUND_SNR = 6.0  # contrast over noise from which a background may be subtracted
BACKGROUND_GAIN = 1.1  # times as sharp above it: what a background must gain without valleys
VALLEY_GAIN = 2.0  # ... and where the field has a valley
PADDING_SHARE = 0.5  # share of the outside's distance from padding within which padding is outside
HALF_HEIGHTS = 3  # levels looked for above the last valley
LEAST_VOXELS = 500  # voxels above a level
FEW_VOXELS = 100  # voxels below which nothing is said of a slope, or of a side of a level in a tile
WIDTH_SHARE = 0.05  # half of the range around a level, as a share of its contrast, judged there
TENTH = 0.1  # share of the contrast by which a level is moved to see what depends on it
LEAST_NOISE = 1e-3  # share of the values' range: noise-free data is given so much


@dataclass(frozen=True, slots=True)
class Level:
    """A level with what speaks for it. Values in voxel values.

    value       of the field, or of the field above the background
    inside      what stands for the voxels above it
    outside     what stands for the voxels below it
    snr         contrast (inside - outside) over noise
    sharpness   mean slope at the level times the finest spacing, over the contrast
    separation  share of the variance that lies between the voxels above and below, 0..1
    dip         the valley's height over the lower of its two peaks, 0..1; 1: it lies in no valley
    stability   Dice, 0..1, between what lies above the level moved down and up by a tenth of the
                contrast
    share       of all voxels that lie above it, 0..1
    """

    value: float
    inside: float
    outside: float
    snr: float
    sharpness: float
    separation: float
    dip: float
    stability: float
    share: float

    @property
    def contrast(self) -> float:
        """The difference between inside and outside, voxel values."""
        return self.inside - self.outside

    @property
    def confidence(self) -> float:
        """How sure a surface at this level is, 0..1."""
        return max(0.0, 1.0 - 2.0 / self.snr) * self.stability if self.snr > 0 else 0.0

    @property
    def is_clear(self) -> bool:
        if self.snr < LEAST_SNR or self.sharpness < LEAST_SHARPNESS:
            return False
        if self.dip <= DIP or self.separation >= LEAST_SEPARATION:
            return True
        return all(getattr(self, name) >= least for name, least in WEAKER.items())


@dataclass(frozen=True, slots=True)
class ChannelLevels:
    """A channel's levels.

    ladder       all that were found, outermost first; empty where all voxels are equal
    subtracts    whether they are levels above the background
    has_padding  whether padding took no part
    noise        sigma of the denoised field, voxel values
    finest_um    the finest voxel spacing
    histogram    of the field, or of the field above the background
    """

    ladder: tuple[Level, ...]
    subtracts: bool
    has_padding: bool
    noise: float
    finest_um: float
    histogram: LevelHistogram

    @property
    def clear(self) -> tuple[Level, ...]:
        """The clear ones, outermost first."""
        return tuple(level for level in self.ladder if level.is_clear)

    def judge_tile(self, level: Level, tile: TileEvidence) -> Level | None:
        """Return a level with what speaks for it in one tile; None: it parts nothing there."""
        sums = tile.above if self.subtracts and tile.above is not None else tile.plain
        if not self.subtracts and not self.has_padding:
            sums = sums + tile.padding
        sight = _Sight(sums, self.histogram.edges, self.noise, self.finest_um)
        above = sight.histogram.above(level.value).total
        if min(above, sight.histogram.total - above) < FEW_VOXELS:
            return None
        return sight.judge(level.value, sight.histogram, level.dip)


def find_levels(
    tiles: Sequence[TileEvidence],
    *,
    scale: Scale,
    scale_above: Scale | None,
    darkest: float,
    finest_um: float,
    modality: str = "",
) -> ChannelLevels:
    """Return a channel's levels.

    tiles        of the whole dataset
    scale        of the values, as the tiles were counted; scale_above: above the background
    darkest      the channel's least value
    finest_um    the finest voxel spacing
    modality     DICOM's code; of CT and MR no background is subtracted
    """
    plain = reduce(Sums.__add__, (tile.plain for tile in tiles))
    padding = reduce(Sums.__add__, (tile.padding for tile in tiles))
    noise = _noise(tiles, scale, plain)
    sight = _Sight(plain, scale.edges(), noise, finest_um)
    ladder = sight.ladder()
    has_padding = bool(padding.counts.any())
    if has_padding and (modality == "MR" or _is_outside(darkest, sight.histogram, ladder)):
        has_padding = False
        sight = _Sight(plain + padding, scale.edges(), noise, finest_um)
        ladder = sight.ladder()
    above = [tile.above for tile in tiles if tile.above is not None]
    if above and scale_above is not None and modality not in ("CT", "MR"):
        raised = _Sight(reduce(Sums.__add__, above), scale_above.edges(), noise, finest_um)
        other = raised.ladder()
        if _gains(_first(ladder), _first(other)):
            return ChannelLevels(other, True, has_padding, noise, finest_um, raised.histogram)
    return ChannelLevels(ladder, False, has_padding, noise, finest_um, sight.histogram)


def _first(ladder: Sequence[Level]) -> Level | None:
    return next((level for level in ladder if level.is_clear), None)


def _is_outside(darkest: float, histogram: LevelHistogram, ladder: Sequence[Level]) -> bool:
    """Whether padding is dark ground: no gap in the histogram parts it from the rest."""
    if not ladder:
        return True
    return histogram.quantile(0.001) - darkest <= PADDING_SHARE * (ladder[0].outside - darkest)


def _gains(plain: Level | None, above: Level | None) -> bool:
    """Whether the level above the background is to be taken."""
    if above is None or above.snr < BACKGROUND_SNR:
        return False
    if plain is None:
        return True
    if plain.dip <= DIP:
        return above.dip <= DIP and above.sharpness >= VALLEY_GAIN * plain.sharpness
    return above.dip <= DIP or above.sharpness >= BACKGROUND_GAIN * plain.sharpness


class _Sight:
    """One way to see a channel: its field, or the field above the background."""

    def __init__(
        self, sums: Sums, edges: NDArray[np.float64], noise: float, finest_um: float
    ) -> None:
        self.histogram = LevelHistogram(sums.counts.astype(np.float64), edges)
        self.slopes, self.noise, self.finest_um = sums.slopes, noise, finest_um

    def ladder(self) -> tuple[Level, ...]:
        """Return the levels, outermost first."""
        whole = self.histogram
        if not whole.total:
            return ()
        valleys = whole.find_valleys(self.noise)
        span = whole.quantile(0.999) - whole.quantile(0.05)
        found = []
        ends = [-np.inf, *(valley.value for valley in valleys), np.inf]
        for valley, low, high in zip(valleys, ends, ends[2:], strict=False):
            outside = whole.between(low, valley.value).quantile(0.5)
            value = float(np.clip((valley.peak + outside) / 2, valley.low, valley.high))
            level = self.judge(value, whole.between(low, high), valley.dip)
            if (
                level.contrast >= LEAST_CONTRAST * span
                and level.share * whole.total >= LEAST_VOXELS
            ):
                found.append(level)
        rest = whole.above(ends[-2])
        for _ in range(HALF_HEIGHTS):
            value = rest.half_height() if rest.total >= LEAST_VOXELS else np.nan
            if not np.isfinite(value):
                break
            found.append(self.judge(value, rest, 1.0))
            rest = rest.above(value)
        return tuple(found)

    def judge(self, value: float, part: LevelHistogram, dip: float) -> Level:
        """Return a level with what speaks for it; `part` holds the voxels that it separates."""
        above, below = part.above(value), part.below(value)
        inside, outside = above.quantile(INSIDE), below.quantile(OUTSIDE)
        contrast = max(inside - outside, 1e-12)
        slope = self._slope(value, max(WIDTH_SHARE * contrast, 2 * part.width_at(value)))
        low, high = (part.above(value + d * contrast).total for d in (-TENTH, TENTH))
        return Level(
            value=value,
            inside=inside,
            outside=outside,
            snr=contrast / self.noise,
            sharpness=slope * self.finest_um / contrast,
            separation=_separation(part, value, outside - contrast, inside + contrast),
            dip=dip,
            stability=2 * high / max(1.0, low + high),
            share=self.histogram.above(value).total / self.histogram.total,
        )

    def _slope(self, value: float, width: float) -> float:
        """Return the mean slope around a level, in voxel values per um; 0 where all is far away.

        The range grows until it holds voxels: between the heights of noise-free bodies are few.
        """
        away = np.abs(self.histogram.centres - value)
        for factor in (1, 2, 4, 8):
            near = away <= factor * width
            count = float(self.histogram.counts[near].sum())
            if count >= FEW_VOXELS:
                return float(self.slopes[near].sum()) / count
        return 0.0


def _separation(part: LevelHistogram, value: float, low: float, high: float) -> float:
    """Return the share of the variance that lies between the voxels above and below a level, 0..1.

    Values beyond `low` and `high` count as these: a few far ones would be most of the variance.
    """
    values, counts = np.clip(part.centres, low, high), part.counts
    is_above = part.centres > value
    share = float(counts[is_above].sum()) / part.total
    if not 0 < share < 1:
        return 0.0
    mean = float(np.average(values, weights=counts))
    variance = float(np.average((values - mean) ** 2, weights=counts))
    means = [float(np.average(values[k], weights=counts[k])) for k in (is_above, ~is_above)]
    between = share * (1 - share) * (means[0] - means[1]) ** 2
    return between / variance if variance > 0 else 0.0


def _noise(tiles: Sequence[TileEvidence], scale: Scale, plain: Sums) -> float:
    """Return the noise's sigma, voxel values: by the differences' median, as of a normal spread."""
    sums = np.cumsum(np.sum([tile.differences for tile in tiles], axis=0))
    edges = noise_edges(scale)
    median = float(np.interp(0.5 * sums[-1], sums, (edges[1:] + edges[:-1]) / 2))
    histogram = LevelHistogram(plain.counts.astype(np.float64), scale.edges())
    spread = histogram.quantile(0.99) - histogram.quantile(0.01) if histogram.total else 0.0
    least = max(LEAST_NOISE * spread, 1e-9 * (scale.high - scale.low))
    return max(1.4826 * median / 2**0.5, least) if sums[-1] else least
