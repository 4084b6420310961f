"""Write a channel's 2D transfer functions and its joint histogram.

channels/<channel>/transfer2d.json    shapes of each function, numbers: see transfer2d.schema.json
channels/<channel>/histogram2d.ktx2   number of voxels by value and gradient, on a logarithmic scale

Voxels are counted in the bundle's 8-bit volumes, so the histogram fits the image that the viewer
draws. Hidden tiles do not count, and edited windows do. The files are separate, because a phone
needs them only if a 2D function is drawn or edited.
"""

import zlib
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.ktx2 import encode_2d
from stereocell.model.world_box import WorldPoint
from stereocell.transfer.joint_histogram import COLUMNS, ROWS, count_joint, log_scaled
from stereocell.usd.composed_appearance import ComposedAppearance

COUNTED_VOXELS = 4_000_000  # voxels of a tile that are counted; slices of a larger one are skipped
_STORED = np.dtype("<u4")


class PlacedVolume(Protocol):
    """The place of a volume, as in `usd.read_volume.ComposedVolume`."""

    @property
    def measured(self) -> Path | None: ...
    @property
    def size(self) -> tuple[int, int, int]: ...
    @property
    def apron(self) -> int: ...
    @property
    def low(self) -> WorldPoint: ...
    @property
    def high(self) -> WorldPoint: ...
    @property
    def matrix(self) -> NDArray[np.float64]: ...


def count_tile(voxels: NDArray[np.uint8], volume: PlacedVolume, gradient_max: float) -> bytes:
    """Count the voxels of one tile by value and gradient.

    voxels        uint8 (z, y, x), with the apron; its voxels give gradients but are not counted
    gradient_max  gradient of the histogram's last row, see transfer/joint_histogram.py

    Returns compressed counts, since the counts of thousands of tiles are stored until they are
    added. A plane that two tiles share is counted in both.
    """
    box = zip(volume.low, volume.high, volume.size, strict=True)
    x, y, z = ((b - a) / max(1, n - 1 - 2 * volume.apron) for a, b, n in box)
    cut = volume.apron - 1  # leaves a border of one voxel around the counted voxels
    own = voxels[(slice(cut, -cut or None),) * 3] if cut >= 0 else np.pad(voxels, 1, mode="edge")
    every = -(-own.size // COUNTED_VOXELS)
    # Across a single slice, the spacing of a volume is 0. The finest other spacing replaces it.
    finest = min(step for step in (x, y, z, 1.0) if step > 0)
    spacing = (z or finest, y or finest, x or finest)
    counts = count_joint(own, spacing, gradient_max=gradient_max, every=every)
    return zlib.compress(counts.astype(_STORED).tobytes(), 1)


def sum_tiles(tiles: Iterable[bytes]) -> NDArray[np.int64]:
    """Return the sum of the counts of all tiles, int64 (ROWS, COLUMNS)."""
    total = np.zeros(ROWS * COLUMNS, np.int64)
    for packed in tiles:
        total += np.frombuffer(zlib.decompress(packed), _STORED)
    return total.reshape(ROWS, COLUMNS)


def encode_histogram(counts: NDArray[np.int64]) -> bytes:
    """Return the counts as an image: KTX2, R8, logarithmic; row 0 is gradient 0."""
    return encode_2d(log_scaled(counts)[..., np.newaxis]).data


def describe(
    appearance: ComposedAppearance, counts: NDArray[np.int64], histogram: dict[str, Any]
) -> dict[str, Any]:
    """Return the content of transfer2d.json.

    histogram  reference to the file of the histogram
    """
    return {**asdict(appearance.transfer_2d), "histogram": histogram, "most": int(counts.max())}
