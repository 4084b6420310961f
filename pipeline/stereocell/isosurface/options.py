"""Settings of the iso-value and of the surface. Light to import: every command reads them."""

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
    """A way to choose the iso-value by edges: the level with the largest score.

    score            of a level's surface, by its total gradient and its area, float64 (bins,) each
    discounts_noise  whether noise's part is taken out of the gradients first, and levels with a
                     small total can't be chosen
    """

    score: Callable[[Any, Any], Any]
    discounts_noise: bool = False


LADDER, ADAPTIVE = "ladder", "adaptive"
CRITERIA = {
    "edges": Criterion(lambda total, area: total / area**0.5, discounts_noise=True),
    "compromise": Criterion(lambda total, area: total / area**0.5),
    "pekar-mean": Criterion(lambda total, area: total / area),
    "pekar-total": Criterion(lambda total, area: total),
    "pekar-area": Criterion(lambda total, area: area),
}
RUNGS = {"outer": 0, "inner": 1, "third": 2}  # names of the ladder's levels, outermost first
APART = "apart"  # the first rung whose components are many: that of cells in their tissue
CONNECTED = "connected"  # the lowest level that keeps vessels connected and floods nothing
NO_SURFACE = "none"  # no level has a surface: the channel is drawn as a volume alone
SCOPES = ("channel", "tile")


def parse_level(where: str, given: float | str) -> tuple[float, bool]:
    """Return a given iso-value, and whether it counts from the background: `162+b`.

    Raises UsageError for what is neither.
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
            "background as 162+b"
        )
    return value, bool(plus)


@dataclass(frozen=True, slots=True)
class IsoValueOptions:
    """How iso-values are found.

    Raises UsageError for an unknown criterion or a number out of range.
    """

    criterion: str = setting(
        LADDER,
        f"{LADDER}: by histograms of all tiles; {', '.join(CRITERIA)}: by edges; {ADAPTIVE}: the "
        "channel's threshold",
        flag=Flag(
            "--iso-criterion", "how iso-values are found: ladder (default), edges, adaptive, ..."
        ),
    )
    scope: str = setting(
        "channel",
        "channel: one level for all tiles; tile: each tile's own, near the channel's",
        flag=Flag("--iso-scope", "channel (default): one level for all tiles; tile: each its own"),
    )
    rung: str = setting(
        "outer",
        f"which clear level has the surface: {', '.join(RUNGS)}; {APART}: the first whose largest "
        "components hold under a quarter of all, or the least of it where cells touch; "
        f"{CONNECTED}: the lowest at which vessels hang together and nothing else is inside; "
        f"{NO_SURFACE}: no level has one",
    )
    bins: int = setting(256, "levels that a criterion of edges tries", bounds=Bounds(16, 65536))
    clip_percentile: float = setting(
        99.99, "brighter voxels (hot pixels) are left out there", bounds=Bounds(0, 100)
    )
    min_area_share: float = setting(
        0.02, "of the largest surface; leaves out specks there", bounds=Bounds(0, 1)
    )

    def __post_init__(self) -> None:
        known = (LADDER, *CRITERIA, ADAPTIVE)
        for name, found, expected in (
            ("criterion", self.criterion, known),
            ("scope", self.scope, SCOPES),
            ("rung", self.rung, (*RUNGS, APART, CONNECTED, NO_SURFACE)),
        ):
            if found not in expected:
                raise UsageError(
                    f"isovalue.{name} is {found!r}, expected one of {', '.join(expected)}"
                )
        if self.clip_percentile == 0:
            raise UsageError("isovalue.clip_percentile is 0, expected more than 0 and at most 100")
        require_bounds("isovalue", self)


WRAPS = ("voxels", "alpha-wrap")
# `auto` sizes of fragments and cavities count in spacings of the coarsest axis, of which one is
# taken for STEP_FINEST finest at most; no size is under LEAST_COARSEST coarsest
STEP_FINEST, LEAST_COARSEST = 3.0, 1.5
# A preset's size of bodies holds up to this share of the field of view's longest edge: a head of
# 250 mm has no bodies of 10 mm that matter, and a finger of 60 mm has
FIELD_SHARE = 0.05


@dataclass(frozen=True, slots=True)
class SurfaceOptions:
    """Lengths in um; `auto` follows the voxel spacing."""

    smoothing_um: float | str = setting(
        AUTO, "sigma of the Gaussian; auto: the finest spacing", bounds=LENGTH_UM
    )
    max_shift: float = setting(
        2.0,
        "the Gaussian moves a value by no more than so many deviations of the noise, so that thin "
        "structures stay; 0: by any",
        bounds=Bounds(0, 1e6),
    )
    alpha_um: float | str = setting(
        AUTO,
        "radius of the ball that closes gaps; auto: by the channel's components, see max_alpha_um",
        bounds=LENGTH_UM,
    )
    max_alpha_um: float | str = setting(
        AUTO, "what auto alpha may reach; auto: 2 coarsest spacings", bounds=LENGTH_UM
    )
    offset_um: float | str = setting(
        0.0,
        "how far outside the surface lies: volumes grow by it; auto: a tenth of alpha",
        bounds=LENGTH_UM,
    )
    grid_um: float = setting(
        0.0,
        "planes of voxels so far apart carry the surface; 0: all; .42 alpha shows what alpha does",
        bounds=LENGTH_UM,
    )
    max_thin: float = setting(
        0.05,
        "share of a channel's voxels above its level in structures too thin for planes grid_um "
        "apart; where there are more, all planes carry its surface; 1: planes grid_um apart do",
        bounds=Bounds(0, 1),
    )
    max_faces: int = setting(
        5_000_000,
        "voxel faces of a unit's surface: where noise or a sponge has more, planes farther apart "
        "carry the channel's surface",
        bounds=COUNT,
    )
    max_share: float = setting(
        0.5,
        "share of the specimen that a channel's surface may hold beside smaller ones of others; "
        "beyond it the channel is a volume alone; 1: each has its surface",
        bounds=Bounds(0, 1),
    )
    body_um: float = setting(
        0.0,
        "size of the least bodies that matter, which presets state; counts up to a twentieth of "
        "the field of view's longest edge; 0: the voxel spacing tells it",
        bounds=LENGTH_UM,
    )
    min_diagonal_um: float | str = setting(
        AUTO,
        "smaller fragments go; auto: body_um, and without it 3 coarsest spacings, of 3 finest at "
        "most",
        bounds=LENGTH_UM,
    )
    max_fragment_um: float | str = setting(
        AUTO,
        "fragments up to this go as well if they are under half the mean of the channel's "
        "components, by diagonal or by triangles; auto: 6 coarsest spacings, of 3 finest at most, "
        "and at most twice body_um or a given min_diagonal_um; 0: none do",
        bounds=LENGTH_UM,
    )
    max_cavity_um: float | str = setting(
        AUTO,
        "smaller cavities fill; auto: 4 coarsest spacings, of 3 finest at most",
        bounds=LENGTH_UM,
    )
    wrap: str = setting(
        "voxels",
        "how gaps are closed: voxels, or alpha-wrap (a single tile; package pymeshlab)",
        flag=Flag(
            "--wrap", "how gaps are closed: voxels (default), alpha-wrap (pymeshlab, one tile)"
        ),
    )
    closed_tiles: bool = setting(
        False,
        "whether the stage gets a closed STL of every tile and channel, in um",
        flag=Flag(
            "--closed-tiles",
            "also a closed STL of every tile and channel, for printing and booleans",
        ),
    )
    caps: bool = setting(
        True,
        "whether flat caps close surfaces at the block's faces; without, they are open there",
        flag=Flag(
            "--caps",
            "flat caps close surfaces at the block's faces (default); --no-caps leaves them open",
        ),
    )
    keep_holder: bool = setting(
        False,
        "whether a CT's table, head holder, pads and cables, apart from the body, are built too",
        flag=Flag(
            "--keep-holder",
            "build a CT's table, holder, pads and cables too (default: they are left out)",
        ),
    )
    background_um: float | str = setting(
        AUTO,
        "blocks of the background, as large as the largest bodies; auto: 64 finest; 0: none",
        bounds=LENGTH_UM,
    )

    def __post_init__(self) -> None:
        require_bounds("surface", self)

    def resolved(self, spacing_um: Spacing, field_um: float = inf) -> "SurfaceOptions":
        """Return the options with lengths in place of `auto`, but for alpha and offset.

        field_um  longest edge of the field of view

        `auto` alpha and offset follow from the connected components. Raises UsageError for a value
        out of range.
        """
        coarsest = max(spacing_um)
        # thick slices say nothing of how large a body is; a speck of one slice is one all the same
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
                f"surface.offset_um is {self.offset_um:g}, expected at most a voxel ({coarsest:g})"
            )
        return replace(self, **lengths)
