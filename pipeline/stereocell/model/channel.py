"""How a channel is drawn: colour, window, iso-value and transfer functions."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stereocell.model.identifiers import to_identifier
from stereocell.model.lattice_field import LatticeField

SurfaceConfidence = Literal["clear", "unsure", "none"]
# 0..1; a surface with less is unsure. Half of the unsure surfaces were right
# (docs/decisions/levels.md).
LOW_CONFIDENCE = 0.6
DEFAULT_FUNCTION = "default"  # transfer function of a stage that selects none
OpacityPoints = tuple[tuple[float, float], ...]  # (intensity, opacity), both 0..1, rising intensity
ShapeKind = Literal["rectangle", "triangle"]


@dataclass(frozen=True, slots=True)
class Shape:
    """One shape of a 2D transfer function; see transfer/shapes2d.py and docs/transfer-functions.md.

    values     least and largest intensity, 0..1 in the window; a triangle has them at
               `gradients[1]`
    gradients  least and largest gradient, 0..1 of the channel's gradient_max
    tip        intensity, 0..1, at which the sides of a triangle meet at gradient 0; unused for a
               rectangle
    color      linear RGB, 0..1, multiplied with the channel's colour
    opacity    share of light that one finest voxel spacing absorbs, 0..1
    softness   share of the way from the edges to the middle over which opacity rises, 0..1
    """

    kind: ShapeKind
    values: tuple[float, float]
    gradients: tuple[float, float]
    tip: float
    color: tuple[float, float, float]
    opacity: float
    softness: float


Shapes = tuple[Shape, ...]


@dataclass(frozen=True, slots=True)
class SurfaceLevel:
    """The level of a channel's surface: level(x) = background(x) + iso, in the denoised voxels.

    iso           voxel values above the background; the mean of `by_tile` if tiles differ
    background    voxel values, knots in voxels of the level that is built; None: 0 everywhere
    smoothing_um  sigma of the Gaussian after the median
    by_tile       the iso-values as a field, if tiles have their own (`--iso-scope tile`)
    median_size   size of the median in voxels (z, y, x); 1, 1, 1: no median
    max_shift     most that median and Gaussian may move a value, in voxel values; None: no bound
    """

    iso: float
    background: LatticeField | None
    smoothing_um: float
    by_tile: LatticeField | None = None
    median_size: tuple[int, int, int] = (1, 3, 3)
    max_shift: float | None = None

    @property
    def field(self) -> LatticeField:
        """The iso-value as a field, above the background."""
        if self.by_tile is not None:
            return self.by_tile
        return LatticeField(((0.0,), (0.0,), (0.0,)), np.full((1, 1, 1), self.iso))

    @property
    def background_range(self) -> tuple[float, float] | None:
        """The background's least and largest value; None: there is none."""
        if self.background is None:
            return None
        return float(self.background.values.min()), float(self.background.values.max())

    @property
    def words(self) -> str:
        """The level as text, for example `162 above a background of 90 to 210`."""
        span = self.background_range
        above = "" if span is None else f" above a background of {span[0]:.4g} to {span[1]:.4g}"
        return f"{self.iso:.5g}{above}"


@dataclass(frozen=True, slots=True, kw_only=True)
class TransferFunctions2d:
    """A channel's 2D transfer functions, and the numbers that define their scale.

    gradient_max  gradient magnitude that counts as 1 in shapes; see transfer/joint_histogram.py
    functions     shapes by the function's name; empty: all functions of the channel are 1D

    All fields except `functions` are numbers. They have the same names in survey.json, in the stage
    (usd/numbers2d.py) and in the bundle's transfer2d.json. Defaults are those of schemas/usd.
    """

    gradient_max: float = 0.5
    functions: dict[str, Shapes] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Appearance:
    """How one channel is drawn in all tiles.

    color             linear RGB, 0..1
    window            voxel values that become 0 and 1 in the 8-bit volumes
    iso_value         iso-value plus the mean background, voxel values; None: there is no surface
    iso_confidence    confidence of the channel's level, 0..1
    surface           whether there is a clear or an unsure surface, or none
    transfer_functions  opacity points by name; `default` is among them
    painted_by        ID of the channel whose intensity is painted on the surface; empty: none
    transfer_2d       the two-dimensional functions
    threshold         voxel value at which the specimen begins (adaptive_threshold.py); None: not
                      found
    surface_reason    why there is no surface, or why it is unsure; empty: it is clear
    level             the exact level of the surface; None: there is none
    function          transfer function that the channel opens with
    opens             whether the channel shows when the specimen is opened
    """

    name: str
    color: tuple[float, float, float]
    window: tuple[float, float]
    iso_value: float | None
    iso_confidence: float
    surface: SurfaceConfidence
    transfer_functions: dict[str, OpacityPoints]
    painted_by: str = ""
    transfer_2d: TransferFunctions2d = field(default_factory=TransferFunctions2d)
    threshold: float | None = None
    surface_reason: str = ""
    level: SurfaceLevel | None = None
    function: str = "default"
    opens: bool = True

    @property
    def id(self) -> str:
        return to_identifier(self.name)

    @property
    def iso_normalized(self) -> float | None:
        """The iso-value on the window's scale, 0..1."""
        return normalized(self.iso_value, self.window)

    @property
    def threshold_normalized(self) -> float | None:
        """The threshold on the window's scale, 0..1."""
        return normalized(self.threshold, self.window)


def normalized(value: float | None, window: tuple[float, float]) -> float | None:
    """Return a voxel value on a window's scale, 0 at its lower and 1 at its upper end."""
    low, high = window
    return None if value is None else (value - low) / (high - low)


@dataclass(frozen=True, slots=True)
class PaintColors:
    """The colour of a surface and of the channel that is painted on it, linear RGB, 0..1."""

    base: tuple[float, float, float]
    painted: tuple[float, float, float]

    def mix(self, intensity: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return linear RGB, float32 (..., 3), of intensities, uint8 (...).

        0 gives the surface's colour, 255 the painted channel's; values between mix them linearly.
        """
        share = intensity[..., None].astype(np.float32) / 255
        base, painted = (np.array(color, np.float32) for color in (self.base, self.painted))
        return base + share * (painted - base)
