"""How a channel is drawn: colour, window, iso-value and transfer functions."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stereocell.model.identifiers import to_identifier
from stereocell.model.lattice_field import LatticeField

SurfaceConfidence = Literal["clear", "unsure", "none"]
LOW_CONFIDENCE = 0.6  # 0..1; half of the surfaces below were right (docs/decisions/levels.md)
DEFAULT_FUNCTION = "default"  # the transfer function of a stage that selects none
OpacityPoints = tuple[tuple[float, float], ...]  # (intensity, opacity), both 0..1, rising intensity
ShapeKind = Literal["rectangle", "triangle"]


@dataclass(frozen=True, slots=True)
class Shape:
    """One shape of a 2D transfer function; see transfer/shapes2d.py and docs/transfer-functions.md.

    values     its ends, 0..1 in the window; a triangle's at `gradients[1]`
    gradients  its ends, 0..1 of the channel's gradient_max
    tip        the value, 0..1, at which a triangle's sides meet at gradient 0; a rectangle has none
    color      linear RGB 0..1, a factor to the channel's colour
    opacity    0..1, what one finest voxel spacing absorbs
    softness   0..1, the share of the way from its edges to its middle over which opacity rises
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
    """Where a channel's surface lies: level(x) = background(x) + iso, in the denoised voxels.

    iso           voxel values above the background; the mean of `by_tile`
    background    voxel values, knots in voxels of the level that is built; None: 0 everywhere
    smoothing_um  sigma of the Gaussian after the median
    by_tile       where tiles have levels of their own (`--iso-scope tile`): the field of them
    median_size   voxels (z, y, x) that the median is taken over; 1, 1, 1: there is none
    max_shift     by how much both may move a value, voxel values; None: by any
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
        """The level for a reader: `162 above a background of 90 to 210`."""
        span = self.background_range
        above = "" if span is None else f" above a background of {span[0]:.4g} to {span[1]:.4g}"
        return f"{self.iso:.5g}{above}"


@dataclass(frozen=True, slots=True, kw_only=True)
class TransferFunctions2d:
    """A channel's 2D transfer functions, and the numbers that they are read by.

    gradient_max  the gradient magnitude that is 1 to shapes; see transfer/joint_histogram.py
    functions     shapes by the function's name; empty: all functions of the channel are 1D

    All fields but `functions` are numbers. survey.json, the stage (usd/numbers2d.py) and the
    bundle's transfer2d.json take each over by its name; defaults are those of schemas/usd.
    """

    gradient_max: float = 0.5
    functions: dict[str, Shapes] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Appearance:
    """How one channel is drawn in all tiles.

    color             linear RGB, 0..1
    window            the voxel values that become 0 and 1 in the 8-bit volumes
    iso_value         with the background's mean, in voxel values; None: there is no surface
    iso_confidence    0..1, of the channel
    surface           whether there is one, and whether it is to be trusted
    painted_by        id of the channel whose intensity is painted on the surface; empty: none
    transfer_functions  opacity points by name; `default` is among them
    transfer_2d       those functions that are two-dimensional
    threshold         voxel value where the body begins (adaptive_threshold.py); None: not found
    surface_reason    why there is no surface, or why it is unsure; empty: a clear one
    function          the transfer function that the channel opens with
    opens             whether the channel shows when the specimen is opened
    level             where exactly the surface lies; None: there is none
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
    """Return a voxel value on a window's scale: 0 is its lower end, 1 its upper."""
    low, high = window
    return None if value is None else (value - low) / (high - low)


@dataclass(frozen=True, slots=True)
class PaintColors:
    """A surface's colour and that of the channel that is painted on it, linear RGB 0..1."""

    base: tuple[float, float, float]
    painted: tuple[float, float, float]

    def mix(self, intensity: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return linear RGB (..., 3) of intensities (...): 0 the surface's colour, 255 the other's.

        The intensity of half of the window mixes them half and half.
        """
        share = intensity[..., None].astype(np.float32) / 255
        base, painted = (np.array(color, np.float32) for color in (self.base, self.painted))
        return base + share * (painted - base)
