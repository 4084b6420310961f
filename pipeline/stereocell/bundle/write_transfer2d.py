"""Write a channel's 2D transfer functions, and the histogram that they are placed in.

channels/<channel>/transfer2d.json    shapes by function, and their numbers: transfer2d.schema.json
channels/<channel>/histogram2d.ktx2   voxels by value and gradient magnitude, on a logarithmic scale

The counts are of the bundle's own 8-bit volumes, so that a panel shows what its shader draws, and
what is hidden or has another window in the stage shows so. Files of their own: a phone asks for
them when a 2D function is drawn or edited.
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

COUNTED_VOXELS = 4_000_000  # voxels of a tile; a larger tile is counted in part
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
    """Return the counts of one tile's volume, packed: thousands of them wait for their sum.

    uint8 (z, y, x) with the apron, whose voxels are neighbours only. A plane that tiles share is
    counted in each.
    """
    box = zip(volume.low, volume.high, volume.size, strict=True)
    x, y, z = ((b - a) / max(1, n - 1 - 2 * volume.apron) for a, b, n in box)
    cut = volume.apron - 1  # one voxel round what is counted
    own = voxels[(slice(cut, -cut or None),) * 3] if cut >= 0 else np.pad(voxels, 1, mode="edge")
    every = -(-own.size // COUNTED_VOXELS)
    # a single plane is no distance thick
    finest = min(step for step in (x, y, z, 1.0) if step > 0)
    spacing = (z or finest, y or finest, x or finest)
    counts = count_joint(own, spacing, gradient_max=gradient_max, every=every)
    return zlib.compress(counts.astype(_STORED).tobytes(), 1)


def sum_tiles(tiles: Iterable[bytes]) -> NDArray[np.int64]:
    """Return the counts of all tiles, int64 (ROWS, COLUMNS); no tile: zeros."""
    total = np.zeros(ROWS * COLUMNS, np.int64)
    for packed in tiles:
        total += np.frombuffer(zlib.decompress(packed), _STORED)
    return total.reshape(ROWS, COLUMNS)


def encode_histogram(counts: NDArray[np.int64]) -> bytes:
    """Return the counts as a picture: KTX2, R8, row 0 is gradient 0."""
    return encode_2d(log_scaled(counts)[..., np.newaxis]).data


def describe(
    appearance: ComposedAppearance, counts: NDArray[np.int64], histogram: dict[str, Any]
) -> dict[str, Any]:
    """Return what transfer2d.json holds; `histogram`: the reference to its file."""
    return {**asdict(appearance.transfer_2d), "histogram": histogram, "most": int(counts.max())}
