"""A channel's appearance in a composed stage, as plain values."""

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
    """The iso-value at which a surface was extracted; see model.channel.SurfaceLevel.

    iso           iso-value above the background, in voxel values
    background    smallest and largest value of the background; None: the background is 0
    smoothing_um  sigma of the Gaussian that smoothed the voxels, in um
    """

    iso: float
    background: tuple[float, float] | None
    smoothing_um: float


@dataclass(frozen=True, slots=True)
class ComposedAppearance:
    """The appearance of one channel in the stage; see model.channel.Appearance.

    window          voxel values that are shown as 0 and 1
    volume_window   voxel values that are stored as 0 and 1 in the stage's volumes; equal to
                    `window` unless an edit changed that
    surface         whether the channel has a surface, and whether the surface can be trusted
    surface_reason  why there is no surface, or why it is uncertain; else empty
    level           iso-value, background and smoothing of the surface; None: not stated
    chosen          name of the selected transfer function
    transfer_2d     two-dimensional transfer functions, and their scale of gradients
    threshold       voxel value at which the specimen begins; None: not known
    opens           whether the channel is visible when the specimen is opened
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
        """The iso-value on the window's scale; outside 0..1 if it lies outside the window."""
        return normalized(self.iso_value, self.window)

    @property
    def threshold_normalized(self) -> float | None:
        """The threshold on the window's scale, clipped to 0..1."""
        share = normalized(self.threshold, self.window)
        return None if share is None else min(max(share, 0.0), 1.0)

    def window_voxels(self, voxels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Convert voxels, uint8, from the scale of `volume_window` to that of `window`."""
        if self.window == self.volume_window:
            return voxels
        first, last = self.volume_window
        low, high = self.window
        values = first + np.arange(256) / 255 * (last - first)
        table = np.rint(np.clip((values - low) / (high - low), 0, 1) * 255).astype(np.uint8)
        return table[voxels]
