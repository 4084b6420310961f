"""Find the iso-levels of a channel's surfaces: one set of levels for all tiles of the dataset.

The levels are ordered from the outermost to the innermost: air and skin, then skin and bone;
ground and tissue, then tissue and cells. They are found on histograms that are summed over the
tiles, so that the division into tiles changes nothing.

- Where the histogram has a valley between two peaks, the level lies half-way between the upper
  peak and the median of the darker values. It is kept within the flat part of the valley.
- In MR the outer level separates air from tissue of every brightness. Where air is separated by a
  deep valley, the level is half-way to the dimmest quarter of the tissue. Half-way to the
  brightest peak, the level kept the brain and tore holes into the skin.
- Above the last valley there are no more peaks, for instance where bodies are small or of every
  brightness. There the search begins at Li's threshold. It moves the level until it lies half-way
  between the values inside and outside, which is where a blurred edge has its true place. The same
  search on the voxels above this level finds the next one.

Where bodies have similar heights, the level then moves to the edges nearby (`_refined`). Dim bodies
without a peak of their own beside the ground's peak are looked for below the first valley.

A level is clear if three conditions hold. Inside and outside differ by several times the noise.
Voxels at the level lie on slopes and not in flat noise. And one of these three observations shows
that the level is not one of noise or of endless texture:

- The level lies in a valley.
- The two groups of voxels hold a large share of the variance between them (Otsu's criterion). At
  half height this share is .64 in a normal distribution and .74 in an even one. It is .66 to .69 in
  gamma, log-normal, Pareto and exponential distributions and in every tail of them.
- The slope is steep compared with the usual difference of voxels a few apart. Contrast / noise x
  sharpness was .58 to .81 in noise, textures and uneven grounds.

The channel's surface is the first clear level. A channel without a clear level has no surface.

A smooth background is subtracted if the field alone shows no valley and the edges above the
background are steeper. It is never subtracted from CT or MR, whose values have a meaning of their
own. Padding, which is runs of a darkest value with no other value near it, is not counted. In MR it
counts as air.

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
from stereocell.isosurface.edge_criteria import EdgeSums, choose_by_edges, find_peak
from stereocell.isosurface.level import MAX_RISE, Level, clear_of, shown_of
from stereocell.isosurface.level_evidence import Counting, Sums, TileEvidence, noise_edges
from stereocell.isosurface.level_histogram import DIP, INSIDE, OUTSIDE, LevelHistogram, Scale
from stereocell.isosurface.neighbours import MIN_CORRELATION, neighbour_correlation
from stereocell.isosurface.options import IsoValueOptions

MIN_CONTRAST = 0.1  # share of the values' range: least contrast of a level in a valley
# Largest sharpness of a valley's level, as a share of its contrast per voxel. By central
# differences a perfect step rises by half of its height a voxel. A sharper level lies in the
# blurred edge of something much brighter, and not between two materials.
FLANK = 0.6
BACKGROUND_SNR = 3.0  # contrast over noise from which a background may be subtracted
BACKGROUND_GAIN = 1.1  # least gain in steepness by subtraction, if the level is in no valley
VALLEY_GAIN = 2.0  # least gain in steepness by subtraction, if the level is in a valley
# For the outermost valley of MR that has a level: its largest dip if it separates air from tissue,
# and the quantile of the tissue's values that represents the tissue
AIR_DIP, DIM = 0.3, 0.25
PADDING_SHARE = 0.5  # share of the outside's distance from padding within which padding is outside
HALF_HEIGHTS = 3  # largest number of levels looked for above the last valley
# Least number of voxels above a level: a share of all voxels, kept within these bounds
MIN_SHARE, MIN_VOXELS = 0.002, (100, 500)
FEW_VOXELS = 100  # least voxels for a mean slope, or on one side of a level in a tile
FEW_SHARE = 2e-3  # least share of a tile's voxels on one side of a level, if that is more
WIDTH_SHARE = 0.05  # share of the contrast: half of the range around a level that is judged
TENTH = 0.1  # share of the contrast by which a level is moved to measure its stability
# Bodies have similar heights if the BRIGHTEST quantile above the level exceeds their usual height
# by at most the share ALIKE of the contrast. Then the best of _TRIED levels is taken, between the
# multiples NEAR of the level's height.
BRIGHTEST, ALIKE, NEAR = 0.95, 0.4, (0.75, 1.5)
_TRIED, _BLUR = 128, 8  # number of levels, and the sigma in levels that smooths their scores
TILE_FACTOR = 2.0  # largest ratio between the heights of a tile's own level and the channel's
MIN_NOISE = 1e-3  # share of the values' range: noise that is assumed for data without noise


@dataclass(frozen=True, slots=True)
class ChannelLevels:
    """A channel's levels.

    all_levels   all levels that were found, outermost first; empty if all voxels are equal
    subtracts    whether the values are above the background
    has_padding  whether padding was found and left out
    noise        sigma of the denoised field, voxel values
    finest_um    the smallest of the voxel spacings along z, y and x, um
    sums         sums over the voxels of the field, or of the field above the background
    histogram    histogram of the same values
    light        share of the variance, 0..1, that lies along the axes alone; see axis_profiles.py
    correlation  correlation of neighbouring voxels as read; see neighbours.py
    """

    all_levels: tuple[Level, ...]
    subtracts: bool
    has_padding: bool
    noise: float
    finest_um: float
    sums: Sums
    histogram: LevelHistogram
    light: float
    correlation: float

    @property
    def clear(self) -> tuple[Level, ...]:
        """The clear levels, outermost first: those that can have surfaces."""
        return () if self._why_no_surface else clear_of(self.all_levels)

    def shown(self, highest: float = inf) -> tuple[Level, ...]:
        """Return the levels that may have a surface; see `shown_of`.

        highest  upper end of the display window, in the values of the levels
        """
        return () if self._why_no_surface else shown_of(self.all_levels, highest)

    @property
    def _why_no_surface(self) -> str:
        """The reason why the channel has no surface at any level; empty if it may have one."""
        if self.correlation < MIN_CORRELATION:
            return (
                "neighbouring voxels are unrelated, as in noise: their correlation is "
                f"{self.correlation:z.3f}, expected at least {MIN_CORRELATION:g}"
            )
        first = next(iter(clear_of(self.all_levels)), None)
        # A straight edge of tissue is also a step along an axis, but it lies between two peaks.
        if self.light > MAX_LIGHT and first is not None and first.dip > DIP:
            return (
                f"{self.light:.0%} of the variance lies along the axes alone and in no valley, as "
                f"with uneven light, expected at most {MAX_LIGHT:.0%}"
            )
        return ""

    @property
    def why_unclear(self) -> str:
        """The reason why the channel has no clear level; empty if it has one."""
        if self.clear:
            return ""
        if not self.all_levels:
            return "nothing stands out: no iso-value has more than a few voxels above it"
        if self._why_no_surface:
            return self._why_no_surface
        return max(self.all_levels, key=lambda level: level.confidence).why_unclear

    def judge(self, value: float) -> Level:
        """Return a level that was found by other means, with its measures.

        value  voxel value of the level
        """
        valleys = self._field.histogram.find_valleys(self.noise)
        dips = [valley.dip for valley in valleys if valley.low <= value <= valley.high]
        return self._field.judge(value, self._field.histogram, min(dips, default=1.0))

    def has_both_sides(self, value: float) -> bool:
        """Whether voxels lie both above and below a level. A few hot voxels may be beyond it."""
        return 0 < self.histogram.above(value).total < self.histogram.total

    def judge_tile(self, level: Level, tile: TileEvidence) -> Level | None:
        """Return a level with its measures in one tile; None if it separates nothing there."""
        field = self._field_of(tile)
        if not field.parts(level.value):
            return None
        return field.judge(level.value, field.histogram, level.dip)

    def level_of_tile(self, level: Level, tile: TileEvidence) -> float:
        """Return a tile's own level at half height, drawn to the channel's level.

        The less confidence the tile's own level has, the nearer it stays to the channel's level.
        Its height above the outside is between the channel's divided by TILE_FACTOR and the
        channel's times TILE_FACTOR. A tile with too few voxels on one side keeps the channel's
        level.
        """
        field = self._field_of(tile)
        if not field.parts(level.value):
            return level.value
        own = field.histogram.half_height(start=level.value)
        if not np.isfinite(own) or not field.parts(own):
            return level.value
        weight = field.judge(own, field.histogram, level.dip).confidence
        height = level.value - level.outside
        drawn = level.value + weight * (own - level.value) - level.outside
        return level.outside + min(max(drawn, height / TILE_FACTOR), height * TILE_FACTOR)

    def curve(self, *, points: int = 256) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return voxel values, and the share of voxels around each, scaled to at most 1 (chart)."""
        return self._field.histogram.outline(self.noise, points)

    @property
    def _field(self) -> "_FieldLevels":
        return _FieldLevels(self.sums, self.histogram.edges, self.noise, self.finest_um)

    def _field_of(self, tile: TileEvidence) -> "_FieldLevels":
        sums = tile.above if self.subtracts and tile.above is not None else tile.plain
        if not self.subtracts and not self.has_padding:
            sums = sums + tile.padding
        return _FieldLevels(sums, self.histogram.edges, self.noise, self.finest_um)


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

    tiles      all tiles of the dataset
    counting   scales by which the tiles were counted
    finest_um  the smallest of the voxel spacings along z, y and x, um
    modality   DICOM's code; no background is subtracted from CT and MR
    options    criterion of edges that chooses the only level; None: levels follow from histograms
    subtracts  whether the levels are above the background; None: only if subtraction gains
    """
    scale = counting.scale
    plain = reduce(Sums.__add__, (tile.plain for tile in tiles))
    padding = reduce(Sums.__add__, (tile.padding for tile in tiles))
    noise = _noise(tiles, scale, plain)
    field = _FieldLevels(plain, scale.edges(), noise, finest_um)
    is_body = modality in ("CT", "MR")
    levels = field.find_all(modality)
    has_padding = bool(padding.counts.any())
    if has_padding and (modality == "MR" or _is_outside(counting.darkest, field.histogram, levels)):
        has_padding = False
        field = _FieldLevels(plain + padding, scale.edges(), noise, finest_um)
        levels = field.find_all(modality)
    above, is_raised = [tile.above for tile in tiles if tile.above is not None], False
    if above and counting.scale_above is not None and not is_body and subtracts is not False:
        edges = counting.scale_above.edges()
        raised = _FieldLevels(reduce(Sums.__add__, above), edges, noise, finest_um)
        other = raised.find_all()
        is_raised = bool(subtracts) or _gains(_first(levels), _first(other))
        if is_raised:
            field, levels = raised, other
    light = 0.0
    # Where padding is the ground, the profiles cover bodies alone, since they leave padding out.
    if not is_body and has_padding == bool(padding.counts.any()):
        both = [tile.profiles for tile in tiles if tile.profiles is not None]
        light = share_of_light(
            [one for one in (pair[is_raised] for pair in both) if one is not None],
            [pair[0] for pair in both],
            variance=field.histogram.variance - noise**2,
        )
    neighbours = [tile.neighbours for tile in tiles if tile.neighbours is not None]
    found = ChannelLevels(
        levels,
        is_raised,
        has_padding,
        noise,
        finest_um,
        field.sums,
        field.histogram,
        light,
        neighbour_correlation(neighbours),
    )
    return found if options is None else _by_edges(found, tiles, options)


def _by_edges(
    found: ChannelLevels, tiles: Sequence[TileEvidence], options: IsoValueOptions
) -> ChannelLevels:
    """Return the channel with a single level, the one that a criterion of edges chooses."""
    sums = [tile.edges[found.subtracts] for tile in tiles if tile.edges is not None]
    value = None
    if known := [one for one in sums if one is not None]:
        value = choose_by_edges(reduce(EdgeSums.__add__, known), found.histogram, options=options)
    return replace(found, all_levels=() if value is None else (found.judge(value),))


def _first(levels: Sequence[Level]) -> Level | None:
    return next((level for level in levels if level.is_clear), None)


def _is_outside(darkest: float | None, histogram: LevelHistogram, levels: Sequence[Level]) -> bool:
    """Whether padding is dark ground: no gap lies between its value and those of other voxels."""
    if darkest is None or not levels:
        return True
    return histogram.quantile(0.001) - darkest <= PADDING_SHARE * (levels[0].outside - darkest)


def _gains(plain: Level | None, above: Level | None) -> bool:
    """Whether the level above the background is better than the level of the plain field."""
    if above is None or above.snr < BACKGROUND_SNR:
        return False
    if plain is None:
        return True
    if plain.dip <= DIP:
        return above.dip <= DIP and above.steepness >= VALLEY_GAIN * plain.steepness
    return above.dip <= DIP or above.steepness >= BACKGROUND_GAIN * plain.steepness


class _FieldLevels:
    """One field of a channel: the denoised field, or the same above the background."""

    def __init__(
        self, sums: Sums, edges: NDArray[np.float64], noise: float, finest_um: float
    ) -> None:
        self.histogram = LevelHistogram(sums.counts.astype(np.float64), edges)
        self.sums, self.noise, self.finest_um = sums, noise, finest_um

    def parts(self, value: float) -> bool:
        """Whether a level has more than a few voxels on both sides."""
        above, total = self.histogram.above(value).total, self.histogram.total
        return min(above, total - above) >= max(FEW_VOXELS, FEW_SHARE * total)

    def find_all(self, modality: str = "") -> tuple[Level, ...]:
        """Return the levels, outermost first.

        modality  DICOM's code; except in CT and MR, dim bodies below the first valley are looked
                  for
        """
        whole = self.histogram
        if not whole.total:
            return ()
        finds_dim = modality not in ("CT", "MR")
        valleys = whole.find_valleys(self.noise)
        span = whole.quantile(0.999) - whole.quantile(0.05)
        found: list[Level] = []
        if valleys and finds_dim:
            found += self._find_dim_bodies(whole.below(valleys[0].value))
        ends = [-np.inf, *(valley.value for valley in valleys), np.inf]
        for valley, low, high in zip(valleys, ends, ends[2:], strict=False):
            outside = whole.between(low, valley.value).quantile(0.5)
            part, inside = whole.between(low, high), valley.peak
            # Air may have valleys of its own, from padding and ghosts. Their levels are too low.
            is_air = modality == "MR" and not found and valley.dip <= AIR_DIP
            if is_air:
                inside = min(inside, whole.above(valley.value).quantile(DIM))
            value = float(np.clip((inside + outside) / 2, valley.low, valley.high))
            level = (self.judge if is_air else self._refined)(value, part, valley.dip)
            is_high = level.contrast >= MIN_CONTRAST * span or (finds_dim and level.is_edge)
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
        """Least number of voxels above a level."""
        low, high = MIN_VOXELS
        return min(max(low, MIN_SHARE * self.histogram.total), high)

    def _half_heights(self, rest: LevelHistogram) -> list[Level]:
        """Return levels at half height. Each is found on the voxels above the level before it."""
        found = []
        for _ in range(HALF_HEIGHTS):
            value = rest.half_height() if rest.total >= self._least_voxels else np.nan
            if not np.isfinite(value):
                break
            found.append(self._refined(value, rest, 1.0))
            rest = rest.above(value)
        return found

    def _refined(self, value: float, part: LevelHistogram, dip: float) -> Level:
        """Return a level moved to the edges near `value`, if the bodies have similar heights.

        Near the largest total gradient over the square root of the area the level is taken. In a
        blurred ball, r f(r) is a blur in one dimension, so |f'| r has its maximum at the ball's
        true radius. The half height of a small or thin blurred body lies further in. Bodies of
        every brightness share no level that could be better, so theirs is kept.
        """
        level = self.judge(value, part, dip)
        above = part.above(value)
        if above.quantile(BRIGHTEST) - above.quantile(INSIDE) > ALIKE * level.contrast:
            return level
        height = value - level.outside
        low, high = (level.outside + factor * height for factor in NEAR)
        step = (high - low) / _TRIED
        beyond = 3 * _BLUR  # steps of margin at both ends, where smoothing is not exact
        edges = low + step * np.arange(-beyond, _TRIED + beyond + 1)
        area, total = (
            ndimage.gaussian_filter1d(
                np.diff(np.interp(edges, self.histogram.edges[1:], np.cumsum(sums))), _BLUR
            )[beyond:-beyond]
            for sums in (self.sums.slopes, self.sums.squares)
        )
        score = np.where(area > 0, total / np.sqrt(np.maximum(area, 1e-30)), 0.0)
        if not score.max() > 0:
            return level
        tried = np.asarray(low + (np.arange(_TRIED) + 0.5) * step, np.float64)
        return self.judge(find_peak(tried, score / score.max()), part, dip)

    def _find_dim_bodies(self, part: LevelHistogram) -> list[Level]:
        """Return the level of dim bodies that have too few voxels for a peak, if there are any."""
        for level in self._half_heights(part):
            if level.is_edge:
                return [level]
        return []

    def judge(self, value: float, part: LevelHistogram, dip: float) -> Level:
        """Return a level with its measures; `part` holds the voxels that it separates."""
        above, below = part.above(value), part.below(value)
        inside, outside = above.quantile(INSIDE), below.quantile(OUTSIDE)
        contrast = max(inside - outside, 1e-12)
        width = max(WIDTH_SHARE * contrast, 2 * part.width_at(value))
        slope = self._slope(value, width)
        slope_outside = self._slope(outside, width)
        slope_beside = min(self._slope(inside, width), slope_outside)
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
            # Values without noise have no slope inside or outside.
            rise=min(slope / slope_beside, MAX_RISE) if slope_beside > 0 else MAX_RISE,
            stands_out=min(slope / slope_outside, MAX_RISE) if slope_outside > 0 else MAX_RISE,
        )

    def _slope(self, value: float, width: float) -> float:
        """Return the mean slope around a level, in voxel values per um; 0 if no voxel is near it.

        The range around the level grows until it holds enough voxels. In data without noise, few
        values lie between those of the bodies and the background.
        """
        away = np.abs(self.histogram.centres - value)
        for factor in (1, 2, 4, 8):
            near = away <= factor * width
            count = float(self.histogram.counts[near].sum())
            if count >= FEW_VOXELS:
                return float(self.sums.slopes[near].sum()) / count
        return 0.0


def _separation(part: LevelHistogram, value: float, low: float, high: float) -> float:
    """Return the share of the variance between the voxels above and below a level, 0..1.

    Values beyond `low` and `high` are clipped to them: a few extreme values would make up most of
    the variance.
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
    """Return the noise's sigma, voxel values, from the median difference under a normal spread."""
    sums = np.cumsum(np.sum([tile.differences for tile in tiles], axis=0))
    edges = noise_edges(scale)
    median = float(np.interp(0.5 * sums[-1], sums, (edges[1:] + edges[:-1]) / 2))
    histogram = LevelHistogram(plain.counts.astype(np.float64), scale.edges())
    spread = histogram.quantile(0.99) - histogram.quantile(0.01) if histogram.total else 0.0
    least = max(MIN_NOISE * spread, 1e-9 * (scale.high - scale.low))
    return max(1.4826 * median / 2**0.5, least) if sums[-1] else least
