"""Find the levels of a channel's surfaces on what the whole dataset holds: one for all its tiles.

The levels form a ladder, the outermost first: air and skin, skin and bone; ground and tissue,
tissue and cells. Each is found on histograms that the tiles add up to, so that the cut into tiles
changes nothing.

- Where the histogram has a valley between two peaks, the level lies half-way between the upper peak
  and the median of what is darker, as far as the valley reaches.
- Of MR the outer level parts air from tissue of every brightness: where air lies in a deep valley,
  the level is half-way to the dimmest quarter of the tissue. Half-way to the brightest peak it kept
  the brain and tore the skin.
- Above the last valley there are no more peaks, as where bodies are small or of every brightness.
  There a level begins at Li's threshold and moves until it lies half-way between what it has inside
  and outside, since a blurred edge has its place there. The same again on the voxels above it finds
  the next one.

Where the bodies are alike, the level then moves to the edges nearby (`_refined`). Dim bodies that
have no peak beside the ground's are looked for beneath the first valley too.

A level is clear where what is inside differs from what is outside by several times the noise,
where voxels at the level lie on slopes and not in flat noise, and where one of three things tells
it from a level in noise or in texture without an end: it lies in a valley; or the share of the
variance between the two groups of voxels (Otsu's criterion) is high: at half height it is .64 in a
normal distribution, .66 to .69 in gamma, log-normal, Pareto and exponential ones, and in every tail
of them; .74 in an even one; or its slope is steep beside what voxels a few apart differ by:
contrast / noise x sharpness was .58 to .81 in noise, textures and uneven grounds. The channel's
surface is the first clear level; without one it has none.

A smooth background is subtracted where the field alone shows no valley and edges above the
background are steeper, and never of CT or MR, whose values mean something as they are. Padding,
runs of a darkest value that nothing else comes near, takes no part; in MR it is air.

Measured on the volumes of `make bench-iso`; see docs/decisions/levels.md.

References
N. Otsu, IEEE Trans. Systems, Man, and Cybernetics 9, 1979. doi:10.1109/TSMC.1979.4310076
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from math import inf

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.axis_profiles import MAX_LIGHT, share_of_light
from stereocell.isosurface.edge_criteria import EdgeSums, choose_by_edges
from stereocell.isosurface.level import MAX_RISE, Level, clear_of, shown_of
from stereocell.isosurface.level_evidence import Counting, Sums, TileEvidence, noise_edges
from stereocell.isosurface.level_histogram import DIP, INSIDE, OUTSIDE, LevelHistogram, Scale
from stereocell.isosurface.neighbours import MIN_KINSHIP, kinship
from stereocell.isosurface.options import IsoValueOptions

MIN_CONTRAST = 0.1  # share of the values' range: what a valley's level parts is more than this
# A valley's level as sharp as this is none between two materials: by central differences a step
# rises by half of itself a voxel. It lies in the blurred edge of something much brighter.
FLANK = 0.6
BACKGROUND_SNR = 3.0  # contrast over noise from which a background may be subtracted
BACKGROUND_GAIN = 1.1  # times as sharp above it: what a background must gain without valleys
VALLEY_GAIN = 2.0  # ... and where the field has a valley
# Of MR's outermost valley that has a level: how deep it is where it parts air from tissue, and the
# quantile of the tissue that stands for it
AIR_DIP, DIM = 0.3, 0.25
PADDING_SHARE = 0.5  # share of the outside's distance from padding within which padding is outside
HALF_HEIGHTS = 3  # levels looked for above the last valley
# voxels above a level: this share of all, within these bounds
MIN_SHARE, MIN_VOXELS = 0.002, (100, 500)
FEW_VOXELS = 100  # voxels below which nothing is said of a slope, or of a side of a level in a tile
FEW_SHARE = 2e-3  # ... and share of a tile's voxels, where that is more
WIDTH_SHARE = 0.05  # half of the range around a level, as a share of its contrast, judged there
TENTH = 0.1  # share of the contrast by which a level is moved to see what depends on it
# Bodies are alike where their BRIGHTEST quantile is above their usual height by at most so much of
# the contrast; then the level is the best of _TRIED between these multiples of its height
BRIGHTEST, ALIKE, NEAR = 0.95, 0.4, (0.75, 1.5)
_TRIED, _BLUR = 128, 8  # levels, and the sigma that smooths their scores
TILE_FACTOR = 2.0  # a tile's own level is at most so many times as high above the outside
MIN_NOISE = 1e-3  # share of the values' range: noise-free data is given so much


@dataclass(frozen=True, slots=True)
class ChannelLevels:
    """A channel's levels.

    ladder       all that were found, outermost first; empty where all voxels are equal
    subtracts    whether they are levels above the background
    has_padding  whether padding took no part
    noise        sigma of the denoised field, voxel values
    finest_um    the finest voxel spacing
    sums         of the field, or of the field above the background
    histogram    of the same
    light        share of its variance, 0..1, that lies along the axes alone; see axis_profiles.py
    kinship      correlation of neighbouring voxels as read; see neighbours.py
    """

    ladder: tuple[Level, ...]
    subtracts: bool
    has_padding: bool
    noise: float
    finest_um: float
    sums: Sums
    histogram: LevelHistogram
    light: float
    kinship: float

    @property
    def clear(self) -> tuple[Level, ...]:
        """The clear ones, outermost first: the rungs of the ladder that have surfaces."""
        return () if self._nothing else clear_of(self.ladder)

    def shown(self, highest: float = inf) -> tuple[Level, ...]:
        """Return the levels that may have a surface; see `shown_of`.

        highest  the display window's upper end, in voxel values or above the background
        """
        return () if self._nothing else shown_of(self.ladder, highest)

    @property
    def _nothing(self) -> str:
        """The reason why nothing is there, however clear levels look; empty: something may be."""
        if self.kinship < MIN_KINSHIP:
            return (
                "neighbouring voxels have nothing to do with one another, as in noise: their "
                f"correlation is {self.kinship:z.3f}, expected at least {MIN_KINSHIP:g}"
            )
        first = next(iter(clear_of(self.ladder)), None)
        # a straight edge of tissue is a step along an axis too, but between two peaks
        if self.light > MAX_LIGHT and first is not None and first.dip > DIP:
            return (
                f"{self.light:.0%} of what varies lies along the axes alone, and in no valley, as "
                f"light does and no body, expected at most {MAX_LIGHT:.0%}"
            )
        return ""

    @property
    def doubt(self) -> str:
        """The reason why the channel has no clear level; empty: it has one."""
        if self.clear:
            return ""
        if not self.ladder:
            return "nothing stands out: no level has more than a few voxels above it"
        if self._nothing:
            return self._nothing
        return max(self.ladder, key=lambda level: level.confidence).doubt

    def judge(self, value: float) -> Level:
        """Return what speaks for a level that was found otherwise, voxel values."""
        valleys = self._sight.histogram.find_valleys(self.noise)
        dips = [valley.dip for valley in valleys if valley.low <= value <= valley.high]
        return self._sight.judge(value, self._sight.histogram, min(dips, default=1.0))

    def has_both_sides(self, value: float) -> bool:
        """Whether voxels lie above a level and below it, but for a few hot ones."""
        return 0 < self.histogram.above(value).total < self.histogram.total

    def judge_tile(self, level: Level, tile: TileEvidence) -> Level | None:
        """Return a level with what speaks for it in one tile; None: it parts nothing there."""
        sight = self._sight_of(tile)
        if not sight.parts(level.value):
            return None
        return sight.judge(level.value, sight.histogram, level.dip)

    def level_of_tile(self, level: Level, tile: TileEvidence) -> float:
        """Return a tile's own level by half height, drawn to the channel's by what speaks for it.

        Its height above the outside is at most TILE_FACTOR times the channel's, and at least the
        same part of it. A tile with nothing on one side keeps the channel's level.
        """
        sight = self._sight_of(tile)
        if not sight.parts(level.value):
            return level.value
        own = sight.histogram.half_height(start=level.value)
        if not np.isfinite(own) or not sight.parts(own):
            return level.value
        weight = sight.judge(own, sight.histogram, level.dip).confidence
        height = level.value - level.outside
        drawn = level.value + weight * (own - level.value) - level.outside
        return level.outside + min(max(drawn, height / TILE_FACTOR), height * TILE_FACTOR)

    def curve(self, *, points: int = 256) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return voxel values and the share of the voxels around each, highest 1, for a chart."""
        return self._sight.histogram.outline(self.noise, points)

    @property
    def _sight(self) -> "_Sight":
        return _Sight(self.sums, self.histogram.edges, self.noise, self.finest_um)

    def _sight_of(self, tile: TileEvidence) -> "_Sight":
        sums = tile.above if self.subtracts and tile.above is not None else tile.plain
        if not self.subtracts and not self.has_padding:
            sums = sums + tile.padding
        return _Sight(sums, self.histogram.edges, self.noise, self.finest_um)


def find_levels(
    tiles: Sequence[TileEvidence],
    *,
    counting: Counting,
    finest_um: float,
    modality: str = "",
    options: IsoValueOptions | None = None,
    subtracts: bool | None = None,
) -> ChannelLevels:
    """Return a channel's levels.

    tiles      of the whole dataset
    counting   how they were counted
    finest_um  the finest voxel spacing
    modality   DICOM's code; of CT and MR no background is subtracted
    options    of a criterion that scores edges, whose level is then the only rung; None: the ladder
    subtracts  whether the levels are to be above the background; None: where that gains
    """
    scale = counting.scale
    plain = reduce(Sums.__add__, (tile.plain for tile in tiles))
    padding = reduce(Sums.__add__, (tile.padding for tile in tiles))
    noise = _noise(tiles, scale, plain)
    sight = _Sight(plain, scale.edges(), noise, finest_um)
    is_body = modality in ("CT", "MR")
    ladder = sight.ladder(modality)
    has_padding = bool(padding.counts.any())
    if has_padding and (modality == "MR" or _is_outside(counting.darkest, sight.histogram, ladder)):
        has_padding = False
        sight = _Sight(plain + padding, scale.edges(), noise, finest_um)
        ladder = sight.ladder(modality)
    above, is_raised = [tile.above for tile in tiles if tile.above is not None], False
    if above and counting.scale_above is not None and not is_body and subtracts is not False:
        edges = counting.scale_above.edges()
        raised = _Sight(reduce(Sums.__add__, above), edges, noise, finest_um)
        other = raised.ladder()
        is_raised = bool(subtracts) or _gains(_first(ladder), _first(other))
        if is_raised:
            sight, ladder = raised, other
    light = 0.0
    # where padding is the ground, the profiles, which leave it out, are of bodies alone
    if not is_body and has_padding == bool(padding.counts.any()):
        both = [tile.profiles for tile in tiles if tile.profiles is not None]
        light = share_of_light(
            [one for one in (pair[is_raised] for pair in both) if one is not None],
            [pair[0] for pair in both],
            variance=sight.histogram.variance - noise**2,
        )
    beside = [tile.neighbours for tile in tiles if tile.neighbours is not None]
    found = ChannelLevels(
        ladder,
        is_raised,
        has_padding,
        noise,
        finest_um,
        sight.sums,
        sight.histogram,
        light,
        kinship(beside),
    )
    return found if options is None else _by_edges(found, tiles, options)


def _by_edges(
    found: ChannelLevels, tiles: Sequence[TileEvidence], options: IsoValueOptions
) -> ChannelLevels:
    """Return the same channel with the one level that a criterion of edges chooses."""
    sums = [tile.edges[found.subtracts] for tile in tiles if tile.edges is not None]
    value = None
    if known := [one for one in sums if one is not None]:
        value = choose_by_edges(reduce(EdgeSums.__add__, known), found.histogram, options=options)
    return replace(found, ladder=() if value is None else (found.judge(value),))


def _first(ladder: Sequence[Level]) -> Level | None:
    return next((level for level in ladder if level.is_clear), None)


def _is_outside(darkest: float | None, histogram: LevelHistogram, ladder: Sequence[Level]) -> bool:
    """Whether padding is dark ground: no gap in the histogram parts it from the rest."""
    if darkest is None or not ladder:
        return True
    return histogram.quantile(0.001) - darkest <= PADDING_SHARE * (ladder[0].outside - darkest)


def _gains(plain: Level | None, above: Level | None) -> bool:
    """Whether the level above the background is to be taken."""
    if above is None or above.snr < BACKGROUND_SNR:
        return False
    if plain is None:
        return True
    if plain.dip <= DIP:
        return above.dip <= DIP and above.steepness >= VALLEY_GAIN * plain.steepness
    return above.dip <= DIP or above.steepness >= BACKGROUND_GAIN * plain.steepness


class _Sight:
    """One way to see a channel: its field, or the field above the background."""

    def __init__(
        self, sums: Sums, edges: NDArray[np.float64], noise: float, finest_um: float
    ) -> None:
        self.histogram = LevelHistogram(sums.counts.astype(np.float64), edges)
        self.sums, self.noise, self.finest_um = sums, noise, finest_um

    def parts(self, value: float) -> bool:
        """Whether a level has voxels on both sides, and not just a few."""
        above, total = self.histogram.above(value).total, self.histogram.total
        return min(above, total - above) >= max(FEW_VOXELS, FEW_SHARE * total)

    def ladder(self, modality: str = "") -> tuple[Level, ...]:
        """Return the levels, outermost first.

        modality  DICOM's code; but in CT and MR dim bodies are looked for beneath the first valley
        """
        whole = self.histogram
        if not whole.total:
            return ()
        beneath = modality not in ("CT", "MR")
        valleys = whole.find_valleys(self.noise)
        span = whole.quantile(0.999) - whole.quantile(0.05)
        found: list[Level] = []
        if valleys and beneath:
            found += self._beneath(whole.below(valleys[0].value))
        ends = [-np.inf, *(valley.value for valley in valleys), np.inf]
        for valley, low, high in zip(valleys, ends, ends[2:], strict=False):
            outside = whole.between(low, valley.value).quantile(0.5)
            part, inside = whole.between(low, high), valley.peak
            # air may have valleys of its own, whose levels are too low: padding, ghosts
            is_air = modality == "MR" and not found and valley.dip <= AIR_DIP
            if is_air:
                inside = min(inside, whole.above(valley.value).quantile(DIM))
            value = float(np.clip((inside + outside) / 2, valley.low, valley.high))
            level = (self.judge if is_air else self._refined)(value, part, valley.dip)
            is_high = level.contrast >= MIN_CONTRAST * span or (beneath and level.is_edge)
            is_large = level.share * whole.total >= self._least_voxels
            if is_high and is_large and level.sharpness <= FLANK:
                found.append(level)
        last = max([ends[-2], *(level.value for level in found)])
        for level in self._half_heights(whole.above(last)):
            if not (level.is_flank and clear_of(found)):
                found.append(level)
        return tuple(found)

    @property
    def _least_voxels(self) -> float:
        """How many voxels a level must have above it."""
        low, high = MIN_VOXELS
        return min(max(low, MIN_SHARE * self.histogram.total), high)

    def _half_heights(self, rest: LevelHistogram) -> list[Level]:
        """Return levels at half height, each of the voxels above the one before."""
        found = []
        for _ in range(HALF_HEIGHTS):
            value = rest.half_height() if rest.total >= self._least_voxels else np.nan
            if not np.isfinite(value):
                break
            found.append(self._refined(value, rest, 1.0))
            rest = rest.above(value)
        return found

    def _refined(self, value: float, part: LevelHistogram, dip: float) -> Level:
        """Return a level that follows the edges near `value`, where the bodies are alike.

        It is the one with the largest total gradient over the square root of its area: r f(r) is a
        blur in one dimension, so |f'| r has its maximum at a ball's true radius, and half the
        height of a small or thin body, blurred, lies further in. Bodies of every brightness have no
        level in common that could be better.
        """
        level = self.judge(value, part, dip)
        above = part.above(value)
        if above.quantile(BRIGHTEST) - above.quantile(INSIDE) > ALIKE * level.contrast:
            return level
        height = value - level.outside
        low, high = (level.outside + factor * height for factor in NEAR)
        step = (high - low) / _TRIED
        beyond = 3 * _BLUR  # so that smoothing has no end within the range
        edges = low + step * np.arange(-beyond, _TRIED + beyond + 1)
        area, total = (
            ndimage.gaussian_filter1d(
                np.diff(np.interp(edges, self.histogram.edges[1:], np.cumsum(sums))), _BLUR
            )[beyond:-beyond]
            for sums in (self.sums.slopes, self.sums.squares)
        )
        if not area.max() > 0:
            return level
        score = np.where(area > 0, total / np.sqrt(np.maximum(area, 1e-30)), 0.0)
        return self.judge(float(low + (int(score.argmax()) + 0.5) * step), part, dip)

    def _beneath(self, part: LevelHistogram) -> list[Level]:
        """Return the level of dim bodies, if any: too few for a peak beside the ground's."""
        for level in self._half_heights(part):
            if level.is_edge:
                return [level]
        return []

    def judge(self, value: float, part: LevelHistogram, dip: float) -> Level:
        """Return a level with what speaks for it; `part` holds the voxels that it separates."""
        above, below = part.above(value), part.below(value)
        inside, outside = above.quantile(INSIDE), below.quantile(OUTSIDE)
        contrast = max(inside - outside, 1e-12)
        width = max(WIDTH_SHARE * contrast, 2 * part.width_at(value))
        slope = self._slope(value, width)
        slope_outside = self._slope(outside, width)
        beside = min(self._slope(inside, width), slope_outside)
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
            # noise-free values have no slope beside
            rise=min(slope / beside, MAX_RISE) if beside > 0 else MAX_RISE,
            stands_out=min(slope / slope_outside, MAX_RISE) if slope_outside > 0 else MAX_RISE,
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
                return float(self.sums.slopes[near].sum()) / count
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
    least = max(MIN_NOISE * spread, 1e-9 * (scale.high - scale.low))
    return max(1.4826 * median / 2**0.5, least) if sums[-1] else least
