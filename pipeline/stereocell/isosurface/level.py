"""A level with its measures, and whether a surface at that level can be relied on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, inf

from stereocell.isosurface.level_histogram import DIP

MIN_SNR = 3.0  # least contrast over noise of a clear level
MIN_SHARPNESS = 0.04  # share of a clear level's contrast crossed by one finest spacing, at least
MIN_SEPARATION = 0.70  # least share of the variance between the groups, for a level in no valley
# Steepness from which a level in no valley is clear with any separation; texture has less
MIN_STEEPNESS = 0.95
# Least measures of a level within a clear one, where it is certain that something is there. Bone
# within a head's skin, in planes 5 mm apart, has .67, .11 and 157.
WITHIN = {"separation": 0.66, "sharpness": 0.08, "snr": 12.0}
# Share of each bound above that a nearly clear level reaches. At .8 no empty volume and no
# synthetic volume of the corpus gets another level. At .7 noise gets one.
NEARLY = 0.8
# The two bounds that distinguish a level from noise are relaxed less. A normal distribution has a
# separation of .64 at half height, and noise and textures have a steepness of up to .81.
NEARLY_SEPARATION, NEARLY_STEEPNESS = 0.66, 0.85
# Share of all voxels; a clear level with less inside may show specks of what the outer level holds
FEW_INSIDE = 0.01
# Bounds beyond which a level certainly lies on edges: least contrast over noise, least steepness,
# largest sharpness. They keep levels of components that are much dimmer than others. A step that is
# blurred by a Gaussian of one voxel has a sharpness of 1 / sqrt(2 pi), and no edge is sharper. A
# sharper level lies on the flank of something brighter.
EDGE_SNR, EDGE_STEEPNESS, EDGE_SHARPNESS = 6.0, 1.5, 0.4
# Ratio of contrasts, of bodies in a valley to a level around them, from which that level may be a
# haze. Stain in the cytoplasm of a confocal nucleus has a 52nd of the nucleus' contrast. In the
# volumes of `make bench-iso` bodies have at most 9 times the contrast of dim ones beside them.
HAZE_CONTRAST = 20.0
# Bounds of the slope at a level over the lesser of the slopes at its inside and outside. Where
# values rise evenly through the volume, as light falls off, all three slopes are those of the
# noise.
MIN_RISE, MAX_RISE = 1.35, 1000.0


@dataclass(frozen=True, slots=True)
class Level:
    """A level with its measures. Values are voxel values.

    value       of the field, or of the field above the background
    inside      value that represents the voxels above the level
    outside     value that represents the voxels below the level
    snr         contrast (inside - outside) over noise
    sharpness   mean slope at the level times the finest spacing, over the contrast
    separation  share of the variance that lies between the voxels above and below, 0..1
    dip         the valley's height over the lower of its two peaks, 0..1; 1: it lies in no valley
    stability   Dice, 0..1, of the voxels above the level moved down and up by a tenth of the
                contrast
    share       share of all voxels that lie above the level, 0..1
    rise        slope at the level over the lesser of the slopes at its inside and outside
    stands_out  slope at the level over the slope at its outside
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
    rise: float
    stands_out: float

    @property
    def contrast(self) -> float:
        """The difference between inside and outside, voxel values."""
        return self.inside - self.outside

    @property
    def confidence(self) -> float:
        """How reliable a surface at this level is, 0..1."""
        return max(0.0, 1.0 - 2.0 / self.snr) * self.stability if self.snr > 0 else 0.0

    @property
    def steepness(self) -> float:
        """The slope at the level over the usual difference of voxels a few apart."""
        return self.snr * self.sharpness

    @property
    def is_edge(self) -> bool:
        """Whether the level is certainly one of edges, however low it is."""
        is_steep = self.snr >= EDGE_SNR and self.steepness >= EDGE_STEEPNESS
        return is_steep and self.sharpness <= EDGE_SHARPNESS

    @property
    def is_clear(self) -> bool:
        return not self.why_unclear

    @property
    def why_unclear(self) -> str:
        """The reason why a surface at this level is not reliable; empty if it is."""
        if self.snr < MIN_SNR:
            return (
                f"at {self.value:.5g} inside and outside differ by {self.snr:.1f} times the noise, "
                f"expected at least {MIN_SNR:g}"
            )
        if self.sharpness < MIN_SHARPNESS:
            return (
                f"at {self.value:.5g} the edges rise by {self.sharpness:.1%} of their height per "
                f"voxel, expected at least {MIN_SHARPNESS:.0%}"
            )
        if self.rise < MIN_RISE:
            return (
                f"values rise evenly there: at {self.value:.5g} the slope is "
                f"{floor(100 * self.rise) / 100:.2f} times that beside it, expected at least "
                f"{MIN_RISE:g}"
            )
        if self.dip <= DIP or self.separation >= MIN_SEPARATION:
            return ""
        if self.steepness >= MIN_STEEPNESS:
            return ""
        return (
            "no iso-value separates two groups of voxels better than in noise: at "
            f"{self.value:.5g} {self.separation:.0%} of the variance lies between them, expected "
            f"at least {MIN_SEPARATION:.0%}"
        )

    @property
    def is_clear_within(self) -> bool:
        """Whether the level is clear, given that it lies within a clear level."""
        return self.is_clear or self._reaches(WITHIN)

    @property
    def is_flank(self) -> bool:
        """Whether a level within a clear level lies on the inner flank of that level's own edge.

        On this flank the slope falls inwards. A level with an edge of its own has a steeper slope
        than its outside.
        """
        return self.dip > DIP and self.stands_out < 1.0

    @property
    def is_nearly_clear(self) -> bool:
        """Whether the level is not clear, but would be if the bounds were a little lower."""
        if self.is_clear:
            return False
        bounds = {"snr": MIN_SNR, "sharpness": MIN_SHARPNESS, "rise": MIN_RISE}
        if not self._reaches({name: NEARLY * least for name, least in bounds.items()}):
            return False
        return (
            self.dip <= DIP
            or self.separation >= NEARLY_SEPARATION
            or self.steepness >= NEARLY_STEEPNESS
        )

    def _reaches(self, bounds: Mapping[str, float]) -> bool:
        return all(getattr(self, name) >= least for name, least in bounds.items())


def shown_of(levels: Sequence[Level], highest: float = inf) -> tuple[Level, ...]:
    """Return the levels that may have a surface, outermost first; none without a clear level.

    These are the clear levels. One level outside of the first clear level is put before them if it
    is nearly clear and a surface without it would show specks or a stripped specimen. This holds in
    three cases: it lies in a valley, the first clear level holds few voxels, or the first clear
    level lies above the display window.

    levels   all levels, outermost first
    highest  upper end of the display window, in the levels' values
    """
    clear = clear_of(levels)
    if not clear:
        return ()
    for level in levels[: levels.index(clear[0])]:
        is_stripped = clear[0].share < FEW_INSIDE or clear[0].value > highest
        if level.is_nearly_clear and (level.dip <= DIP or is_stripped):
            return (level, *clear)
    return clear


def bodies_in_haze(level: Level, levels: Sequence[Level]) -> Level | None:
    """Return the level of bodies that may cause a level by their haze; None if there are none.

    These bodies have peaks of their own in the histogram, far above the level. The measures of the
    level do not show this, because a haze is separated from air as clearly as any body.
    """
    for other in clear_of(levels):
        is_far = other.contrast >= HAZE_CONTRAST * level.contrast
        if other.value > level.value and other.dip <= DIP and is_far:
            return other
    return None


def clear_of(levels: Sequence[Level]) -> tuple[Level, ...]:
    """Return the clear levels. A level within a clear one needs less to be clear."""
    found: list[Level] = []
    for level in levels:
        if level.is_clear or (found and level.is_clear_within):
            found.append(level)
    return tuple(found)
