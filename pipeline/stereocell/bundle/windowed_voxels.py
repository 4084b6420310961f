"""Read the voxels of a composed volume as 8 bits, with the window of the composed stage applied.

An edited window is applied to the voxels as measured, if the stage has them. The result is exactly
that of a build with this window. Without the measured voxels, the 8-bit voxels of the build are
rescaled, so the steps between their 256 brightness values remain visible.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.exr import read_atlas
from stereocell.formats.vdb import MEASURED_NAME
from stereocell.formats.vdb_read import VdbValues
from stereocell.model.errors import StageError
from stereocell.transfer.joint_histogram import to_eight_bits
from stereocell.usd.composed_appearance import ComposedAppearance
from stereocell.usd.read_volume import ComposedVolume
from stereocell.usd.written_files import AsWritten


def read_windowed(
    volume: ComposedVolume, appearance: ComposedAppearance, *, as_written: AsWritten | None = None
) -> NDArray[np.uint8]:
    """Return a volume with its apron, uint8 (z, y, x).

    as_written  the lists to compare the file with; None: no comparison

    Raises StageError if the volume's file is damaged, or has another size than the stage states.
    """
    is_edited = appearance.window != appearance.volume_window
    measured = volume.measured if is_edited else None
    if as_written is not None:
        if volume.measured is not None:
            as_written.require(volume.measured)  # the bundle states the hash of this file
        if measured is None:
            as_written.require(volume.atlas)
    if measured is not None:
        return to_eight_bits(read_measured(volume), appearance.window)
    voxels = read_atlas(volume.atlas)
    if voxels.shape != volume.size[::-1]:
        found = tuple(voxels.shape[::-1])
        raise StageError(
            f"{volume.atlas}: found {found} voxels, expected {volume.size}, which the stage "
            "states for this file"
        )
    return appearance.window_voxels(voxels)


def read_measured(volume: ComposedVolume) -> NDArray[np.float32]:
    """Return the voxels as measured, float32 (z, y, x), with the apron.

    Raises StageError if their .vdb is missing or damaged.
    """
    assert volume.measured is not None
    values = VdbValues(volume.measured, MEASURED_NAME)
    low, high, size = (np.array(corner) for corner in (volume.low, volume.high, volume.size))
    spacing = (high - low) / (size - 2 * volume.apron - 1)
    x, y, z = (low - volume.apron * spacing).tolist()
    return values.box((x, y, z), volume.size)
