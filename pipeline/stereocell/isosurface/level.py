"""A level with what speaks for it, and whether a surface can be relied on there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, inf

from stereocell.isosurface.level_histogram import DIP

MIN_SNR = 3.0  # contrast over noise of a clear level
MIN_SHARPNESS = 0.04  # share of the contrast that the finest spacing crosses at a clear level
MIN_SEPARATION = 0.70  # share of the variance between the groups at a level in no valley
MIN_STEEPNESS = 0.95  # ... unless the level lies on steeper slopes than there are in texture
# ... and less again within a clear level, where something is for sure: bone in a head's skin, in
# planes 5 mm apart, has .67, .11 and 157
WITHIN = {"separation": 0.66, "sharpness": 0.08, "snr": 12.0}
# Share of each bound above that a level must reach to fall short of "clear" by only a little. At .8
# no volume of nothing and no made volume of the corpus gets another level. At .7 noise does.
NEARLY = 0.8
# The bounds that tell a level from noise lie nearer: a normal distribution has a separation of .64
# at half height, and noise and textures have a steepness of up to .81
NEARLY_SEPARATION, NEARLY_STEEPNESS = 0.66, 0.85
FEW_INSIDE = 0.01  # share of all voxels: a clear level with less inside may be a speck of the outer
# Of a level that is an edge beyond doubt, as that of bodies much dimmer than others. An edge of its
# own is no sharper than a step after a Gaussian of one voxel, 1 / sqrt(2 pi): a sharper level lies
# on the flank of something brighter.
EDGE_SNR, EDGE_STEEPNESS, EDGE_SHARPNESS = 6.0, 1.5, 0.4
# Contrast of bodies in a valley over that of the level around them, from which that level may be a
# haze: stain in the cytoplasm of a confocal nucleus has a 52nd of the nucleus' contrast. In the
# volumes of `make bench-iso` bodies have 9 times the contrast of dim ones beside them at most.
HAZE_CONTRAST = 20.0
# Slope at a level over the least of the slopes at its inside and outside: where values rise evenly
# through the volume, as light falls off, all three are the noise's
MIN_RISE, MAX_RISE = 1.35, 1000.0


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
    rise        slope at the level over the lesser one of those at its inside and outside
    stands_out  slope at the level over that at its outside
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
        """How sure a surface at this level is, 0..1."""
        return max(0.0, 1.0 - 2.0 / self.snr) * self.stability if self.snr > 0 else 0.0

    @property
    def steepness(self) -> float:
        """The slope at the level, over what voxels a few apart usually differ by."""
        return self.snr * self.sharpness

    @property
    def is_edge(self) -> bool:
        """Whether the level is that of edges beyond doubt, however low they are."""
        is_steep = self.snr >= EDGE_SNR and self.steepness >= EDGE_STEEPNESS
        return is_steep and self.sharpness <= EDGE_SHARPNESS

    @property
    def is_clear(self) -> bool:
        return not self.doubt

    @property
    def doubt(self) -> str:
        """The reason why no surface can be relied on here; empty: one can."""
        if self.snr < MIN_SNR:
            return (
                f"at {self.value:.5g} inside and outside differ by {self.snr:.1f} times the noise, "
                f"expected at least {MIN_SNR:g}"
            )
        if self.sharpness < MIN_SHARPNESS:
            return (
                f"at {self.value:.5g} the edges rise by {self.sharpness:.1%} of their height a "
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
            f"no level parts two groups of voxels better than in noise: at {self.value:.5g} "
            f"{self.separation:.0%} of the variance lies between them, expected at least "
            f"{MIN_SEPARATION:.0%}"
        )

    @property
    def is_clear_within(self) -> bool:
        """Whether the level is clear, given that it lies within one that is."""
        return self.is_clear or self._reaches(WITHIN)

    @property
    def is_flank(self) -> bool:
        """Whether, within a clear level, it lies on the inner flank of that level's own edge.

        There the slope falls inwards. What has an edge of its own is steeper there than outside.
        """
        return self.dip > DIP and self.stands_out < 1.0

    @property
    def is_nearly_clear(self) -> bool:
        """Whether the level is not clear, but falls short of it by only a little."""
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


def shown_of(ladder: Sequence[Level], highest: float = inf) -> tuple[Level, ...]:
    """Return the levels that may have a surface, outermost first; none without a clear level.

    These are the clear ones. A level outside of the first clear one goes before them if it is
    nearly clear and skipping it would cut a specimen to specks or strip it: it lies in a valley, or
    the clear level holds few voxels, or the clear level lies above the display window.

    highest  the display window's upper end, in the ladder's values
    """
    clear = clear_of(ladder)
    if not clear:
        return ()
    for level in ladder[: ladder.index(clear[0])]:
        is_stripped = clear[0].share < FEW_INSIDE or clear[0].value > highest
        if level.is_nearly_clear and (level.dip <= DIP or is_stripped):
            return (level, *clear)
    return clear


def bodies_in_haze(level: Level, ladder: Sequence[Level]) -> Level | None:
    """Return the level of bodies in whose haze a level may lie; None: there are none.

    They have peaks of their own in the histogram, far above that level. A haze parts from air as
    clearly as any body, so that its own features do not tell.
    """
    for other in clear_of(ladder):
        is_far = other.contrast >= HAZE_CONTRAST * level.contrast
        if other.value > level.value and other.dip <= DIP and is_far:
            return other
    return None


def clear_of(ladder: Sequence[Level]) -> tuple[Level, ...]:
    """Return the clear levels of a ladder: one within a clear one needs less to be clear."""
    found: list[Level] = []
    for level in ladder:
        if level.is_clear or (found and level.is_clear_within):
            found.append(level)
    return tuple(found)
