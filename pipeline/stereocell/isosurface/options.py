"""Settings of the iso-value and of the surface. Every command imports them, so imports are few."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import Any

from stereocell.model.errors import UsageError
from stereocell.model.settings import (
    AUTO,
    COUNT,
    LENGTH_UM,
    MAX_VOXEL_VALUE,
    Bounds,
    Flag,
    length_um,
    require_bounds,
    setting,
)
from stereocell.model.spacing import Spacing


@dataclass(frozen=True, slots=True)
class Criterion:
    """A way to choose the iso-value by edges: the level with the largest score is taken.

    score            maps a level's total gradient and area, float64 (bins,) each, to its score
    discounts_noise  whether the noise's part is first removed from the gradients, and levels with a
                     small total gradient are excluded
    """

    score: Callable[[Any, Any], Any]
    discounts_noise: bool = False


LEVELS, ADAPTIVE = "levels", "adaptive"
CRITERIA = {
    "edges": Criterion(lambda total, area: total / area**0.5, discounts_noise=True),
    "compromise": Criterion(lambda total, area: total / area**0.5),
    "pekar-mean": Criterion(lambda total, area: total / area),
    "pekar-total": Criterion(lambda total, area: total),
    "pekar-area": Criterion(lambda total, area: area),
}
LEVEL_NAMES = {"outer": 0, "inner": 1, "third": 2}  # names of the levels, outermost first
APART = "apart"  # the level that shows the most separate components: cells in tissue
CONNECTED = "connected"  # the lowest level that keeps vessels connected and floods nothing
NO_SURFACE = "none"  # no surface at any level: the channel is drawn only as a volume
SCOPES = ("channel", "tile")


def parse_level(where: str, given: float | str) -> tuple[float, bool]:
    """Return a given iso-value, and whether it counts from the background as in `162+b`.

    Raises UsageError if the value is neither.
    """
    number, plus, rest = str(given), "", ""
    if isinstance(given, str):
        number, plus, rest = given.replace(" ", "").partition("+")
    try:
        value = float(number)
    except ValueError:
        value = float("nan")
    if not abs(value) <= MAX_VOXEL_VALUE or (plus and rest != "b"):
        raise UsageError(
            f"{where} is {given!r:.60}, expected a voxel value, or one above the "
            "background, such as 162+b"
        )
    return value, bool(plus)


@dataclass(frozen=True, slots=True)
class IsoValueOptions:
    """How iso-values are found.

    Raises UsageError for an unknown criterion or a number out of range.
    """

    criterion: str = setting(
        LEVELS,
        f"{LEVELS}: by the levels of all tiles' histograms; {', '.join(CRITERIA)}: by edges; "
        f"{ADAPTIVE}: by the channel's threshold",
        flag=Flag(
            "--iso-criterion", "how iso-values are found: levels (default), edges, adaptive, ..."
        ),
    )
    scope: str = setting(
        "channel",
        "channel: one iso-value for all tiles; tile: one for each tile, near the channel's",
        flag=Flag(
            "--iso-scope", "channel (default): one iso-value for all tiles; tile: one for each"
        ),
    )
    level: str = setting(
        "outer",
        f"clear level that has the surface: {', '.join(LEVEL_NAMES)}; {APART}: the one with the "
        "most components, if the largest hold under a quarter of its voxels (two thirds where many "
        f"cells touch); {CONNECTED}: the lowest at which vessels are connected and nothing else "
        f"is inside; {NO_SURFACE}: no level",
    )
    bins: int = setting(
        256, "iso-values that a criterion of edges compares", bounds=Bounds(16, 65536)
    )
    clip_percentile: float = setting(
        99.99,
        "percentile of the voxels up to which a criterion of edges looks for iso-values; hot "
        "pixels are brighter",
        bounds=Bounds(0, 100),
    )
    min_area_share: float = setting(
        0.02,
        "share of the largest surface's area; a criterion of edges ignores smaller ones (specks)",
        bounds=Bounds(0, 1),
    )

    def __post_init__(self) -> None:
        known = (LEVELS, *CRITERIA, ADAPTIVE)
        for name, found, expected in (
            ("criterion", self.criterion, known),
            ("scope", self.scope, SCOPES),
            ("level", self.level, (*LEVEL_NAMES, APART, CONNECTED, NO_SURFACE)),
        ):
            if found not in expected:
                raise UsageError(
                    f"isovalue.{name} is {found!r}, expected one of {', '.join(expected)}"
                )
        if self.clip_percentile == 0:
            raise UsageError("isovalue.clip_percentile is 0, expected more than 0 and at most 100")
        require_bounds("isovalue", self)


WRAPS = ("voxels", "alpha-wrap")
# `auto` sizes of fragments and cavities are multiples of the coarsest spacing, which counts as at
# most STEP_FINEST finest spacings. No size is less than LEAST_COARSEST coarsest spacings.
STEP_FINEST, LEAST_COARSEST = 3.0, 1.5
# Largest share of the field of view's longest edge that a preset's size of bodies may have. In a
# head of 250 mm no bodies under 10 mm matter, but in a finger of 60 mm they do.
FIELD_SHARE = 0.05


@dataclass(frozen=True, slots=True)
class SurfaceOptions:
    """Settings of a channel's surface. Lengths are in um, and `auto` follows the voxel spacing."""

    smoothing_um: float | str = setting(
        AUTO, "sigma of the Gaussian; auto: the finest spacing", bounds=LENGTH_UM
    )
    max_shift: float = setting(
        2.0,
        "largest change of a value by the Gaussian, in standard deviations of the noise; it keeps "
        "thin structures; 0: no limit",
        bounds=Bounds(0, 1e6),
    )
    alpha_um: float | str = setting(
        AUTO,
        "radius of the ball that closes gaps; auto: by the channel's components, see max_alpha_um",
        bounds=LENGTH_UM,
    )
    max_alpha_um: float | str = setting(
        AUTO, "largest alpha that auto may choose; auto: 2 coarsest spacings", bounds=LENGTH_UM
    )
    offset_um: float | str = setting(
        0.0,
        "distance by which the surface moves outward, so that volumes grow; auto: a tenth of alpha",
        bounds=LENGTH_UM,
    )
    grid_um: float = setting(
        0.0,
        "distance between the planes of voxels from which the surface is made; 0: all planes; up "
        "to 0.42 of alpha, every shape that alpha leaves is kept",
        bounds=LENGTH_UM,
    )
    max_thin: float = setting(
        0.05,
        "largest share of a channel's voxels above its iso-value that may lie in structures too "
        "thin for planes grid_um apart; with more of them all planes carry the surface; 1: no "
        "limit",
        bounds=Bounds(0, 1),
    )
    max_faces: int = setting(
        5_000_000,
        "largest number of voxel faces of a unit's surface; where noise or a sponge has more, "
        "planes farther apart carry the channel's surface",
        bounds=COUNT,
    )
    max_share: float = setting(
        0.5,
        "largest share of the specimen inside a channel's surface, if surfaces of other channels "
        "are smaller; a channel with more is drawn only as a volume; 1: no limit",
        bounds=Bounds(0, 1),
    )
    body_um: float = setting(
        0.0,
        "size of the smallest bodies that matter, set by presets; at most a twentieth of the field "
        "of view's longest edge is used; 0: sizes follow from the voxel spacing",
        bounds=LENGTH_UM,
    )
    min_diagonal_um: float | str = setting(
        AUTO,
        "smaller fragments are dropped; auto: body_um, or without it 3 coarsest spacings (at most "
        f"9 finest), and at least {LEAST_COARSEST:g} coarsest",
        bounds=LENGTH_UM,
    )
    max_fragment_um: float | str = setting(
        AUTO,
        "fragments up to this size are dropped too if they have under half the mean diagonal or "
        "triangles of the channel's components; auto: 6 coarsest spacings (at most 18 finest), "
        "at most twice body_um or a given min_diagonal_um, and at least "
        f"{LEAST_COARSEST:g} coarsest; 0: none are",
        bounds=LENGTH_UM,
    )
    max_cavity_um: float | str = setting(
        AUTO,
        "smaller cavities are filled; auto: 4 coarsest spacings (at most 12 finest), and at least "
        f"{LEAST_COARSEST:g} coarsest",
        bounds=LENGTH_UM,
    )
    wrap: str = setting(
        "voxels",
        "how gaps are closed: voxels, or alpha-wrap (single tiles only; package pymeshlab)",
        flag=Flag(
            "--wrap", "how gaps are closed: voxels (default), or alpha-wrap (pymeshlab, one tile)"
        ),
    )
    closed_tiles: bool = setting(
        False,
        "whether the stage gets a closed STL file of each tile and channel, in um",
        flag=Flag(
            "--closed-tiles",
            "also write a closed STL file of each tile and channel, for printing and booleans",
        ),
    )
    caps: bool = setting(
        True,
        "whether flat caps close surfaces at the block's faces; otherwise they are open there",
        flag=Flag(
            "--caps",
            "close surfaces at the block's faces by caps (default); --no-caps leaves them open",
        ),
    )
    keep_holder: bool = setting(
        False,
        "whether a CT scan's table, head holder, pads and cables are built with the body",
        flag=Flag(
            "--keep-holder",
            "build a CT scan's table, holder, pads and cables too (default: they are left out)",
        ),
    )
    background_um: float | str = setting(
        AUTO,
        "size of the blocks in which the background is estimated, at least that of the largest "
        "bodies; auto: 64 finest spacings; 0: no background is subtracted",
        bounds=LENGTH_UM,
    )

    def __post_init__(self) -> None:
        require_bounds("surface", self)

    def resolved(self, spacing_um: Spacing, field_um: float = inf) -> "SurfaceOptions":
        """Return the options with lengths in place of `auto`, except for alpha and offset.

        spacing_um  (z, y, x)
        field_um    longest edge of the field of view

        Alpha and offset of `auto` follow from the connected components. Raises UsageError for a
        value out of range.
        """
        coarsest = max(spacing_um)
        # Thick slices do not show how large bodies are, but a speck of one slice is still a speck.
        step, least = min(coarsest, STEP_FINEST * min(spacing_um)), LEAST_COARSEST * coarsest
        diagonal, fragment = 3 * step, 6 * step
        if self.body_um:
            diagonal = max(min(self.body_um, FIELD_SHARE * field_um), 3 * min(spacing_um))
        if self.min_diagonal_um != AUTO:
            diagonal = float(self.min_diagonal_um)
        if self.body_um or self.min_diagonal_um != AUTO:
            fragment = min(fragment, 2 * diagonal)
        auto = {
            "smoothing_um": min(spacing_um),
            "max_alpha_um": 2 * coarsest,
            "min_diagonal_um": max(diagonal, least),
            "max_fragment_um": max(fragment, least),
            "max_cavity_um": max(4 * step, least),
            "background_um": 64 * min(spacing_um),
        }
        lengths: dict[str, Any] = {
            key: length_um(f"surface.{key}", getattr(self, key), auto[key]) for key in auto
        }
        if self.wrap not in WRAPS:
            raise UsageError(f"surface.wrap is {self.wrap!r}, expected one of {', '.join(WRAPS)}")
        for key in ("alpha_um", "offset_um"):
            length_um(f"surface.{key}", getattr(self, key), 0.0)
        if self.offset_um != AUTO and float(self.offset_um) > coarsest:
            raise UsageError(
                f"surface.offset_um is {self.offset_um:g}, expected at most {coarsest:g} (a voxel)"
            )
        return replace(self, **lengths)
