"""The iso-value as a smooth field between the tiles' centres.

Each tile has its own iso-value, and neighbours must agree on their common plane; so the surface is
taken where f(x) = iso(x), iso running linearly from centre to centre, constant beyond the last.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.tiling import Box, Tile


@dataclass(frozen=True, slots=True)
class IsoField:
    """Iso-values on the grid of tile centres.

    centres  three rising tuples, (z, y, x), in voxels of the level
    values   float64 (z, y, x), one for each combination of centres
    """

    centres: tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
    values: NDArray[np.float64]

    def at(self, box: Box) -> NDArray[np.float32]:
        """Return iso(x) at the voxels of the box, float32 (z, y, x).

        A voxel's value depends on nothing but its place, bit by bit: linear steps axis by axis,
        weights from the voxel's index alone.
        """
        field = self.values
        for axis, centres in enumerate(self.centres):
            voxels = np.arange(box.start[axis], box.stop[axis], dtype=np.float64)
            below = np.searchsorted(np.asarray(centres), voxels, side="right") - 1
            low = np.clip(below, 0, len(centres) - 1)
            high = np.clip(below + 1, 0, len(centres) - 1)
            span = np.asarray(centres)[high] - np.asarray(centres)[low]
            share = (voxels - np.asarray(centres)[low]) / np.where(span > 0, span, 1.0)
            share = np.where(span > 0, share, 0.0)
            a, b = np.take(field, low, axis=axis), np.take(field, high, axis=axis)
            field = a + (b - a) * share.reshape([-1 if i == axis else 1 for i in range(3)])
        return field.astype(np.float32)

    def around(self, window: Box) -> "IsoField":
        """Return the part that reaches into a unit's window: what its result depends on."""
        keep = []
        for axis, centres in enumerate(self.centres):
            first = np.searchsorted(centres, window.start[axis], side="right") - 1
            last = np.searchsorted(centres, window.stop[axis] - 1, side="left")
            keep.append(slice(max(0, int(first)), int(last) + 1))
        z, y, x = (centres[part] for centres, part in zip(self.centres, keep, strict=True))
        return IsoField((z, y, x), self.values[tuple(keep)])


def make_iso_field(tiles: Sequence[Tile], found: Mapping[str, float | None]) -> IsoField | None:
    """Return the field of one channel's iso-values, by tile id; None if no tile has one.

    A tile without a value takes the mean of the channel's others.
    """
    known = [value for value in found.values() if value is not None]
    if not known:
        return None
    centre = {
        tile.id: tuple((a + b - 1) / 2 for a, b in zip(tile.box.start, tile.box.stop, strict=True))
        for tile in tiles
    }
    z, y, x = (tuple(sorted({c[axis] for c in centre.values()})) for axis in range(3))
    values = np.full((len(z), len(y), len(x)), np.mean(known))
    for tile in tiles:
        value = found.get(tile.id)
        if value is not None:
            k, j, i = centre[tile.id]
            values[z.index(k), y.index(j), x.index(i)] = value
    return IsoField((z, y, x), values)
