"""How a composed stage draws a channel, as plain values."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.model.channel import (
    OpacityPoints,
    SurfaceConfidence,
    TransferFunctions2d,
    normalized,
)


@dataclass(frozen=True, slots=True)
class StatedLevel:
    """Where a surface was made, see model.channel.SurfaceLevel.

    iso           voxel values above the background
    background    its least and largest value; None: there is none
    smoothing_um  sigma of the Gaussian
    """

    iso: float
    background: tuple[float, float] | None
    smoothing_um: float


@dataclass(frozen=True, slots=True)
class ComposedAppearance:
    """One channel as the stage draws it; see model.channel.Appearance.

    window         the voxel values to be shown as 0 and 1
    volume_window  those that are 0 and 1 in the stage's volumes: `window` unless it was edited
    surface        whether there is one, and whether it is to be trusted
    surface_reason  why there is none, or why it is unsure; or empty
    level          where the surface lies above the background, which is left out here but for its
                   ends; None: not stated
    chosen         a transfer function
    transfer_2d    those functions that are two-dimensional
    threshold      where the body begins, in voxel values; None: it is not known
    opens          whether the channel shows when the specimen is opened
    """

    id: str
    name: str
    color: tuple[float, float, float]
    window: tuple[float, float]
    volume_window: tuple[float, float]
    iso_value: float | None
    surface: SurfaceConfidence
    chosen: str
    transfer_functions: dict[str, OpacityPoints]
    transfer_2d: TransferFunctions2d
    threshold: float | None = None
    surface_reason: str = ""
    level: StatedLevel | None = None
    opens: bool = True

    @property
    def iso_normalized(self) -> float | None:
        """The iso-value on the window's scale; outside 0..1 where the window leaves it out."""
        return normalized(self.iso_value, self.window)

    @property
    def threshold_normalized(self) -> float | None:
        """The threshold on the window's scale, 0..1: one beyond its ends is drawn at the end."""
        share = normalized(self.threshold, self.window)
        return None if share is None else min(max(share, 0.0), 1.0)

    def window_voxels(self, voxels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return a volume of the stage, uint8 by `volume_window`, as uint8 by `window`."""
        if self.window == self.volume_window:
            return voxels
        first, last = self.volume_window
        low, high = self.window
        values = first + np.arange(256) / 255 * (last - first)
        table = np.rint(np.clip((values - low) / (high - low), 0, 1) * 255).astype(np.uint8)
        return table[voxels]
