"""Fields of iso-values and backgrounds, which are linear between the knots of a grid.

Each tile may have its own iso-value, but neighbours must agree on their common plane. So the
surface is extracted where f(x) = iso(x). The field iso is linear from tile centre to tile centre,
and constant beyond the last one. The background that is subtracted from f is such a field, too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.tiling import Box, Tile

_AT_ONCE = 1 << 16  # voxels; as float64 they fit into a processor's cache


@dataclass(frozen=True, slots=True)
class LatticeField:
    """Values at the knots of a grid.

    centres  positions of the knots along z, y and x, ascending, in voxels of the level
    values   float64 (z, y, x), in voxel values
    """

    centres: tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
    values: NDArray[np.float64]

    def at(self, box: Box) -> NDArray[np.float32]:
        """Return the field at the voxels of a box, float32, which broadcasts over (z, y, x).

        An axis has length 1 if only one centre influences the box. Each value depends only on its
        voxel's position, to the last bit: interpolation runs axis by axis, with weights that follow
        from the voxel's index.
        """
        near = self.around(box)
        weights = [
            _weights(np.asarray(centres), start, stop)
            for centres, start, stop in zip(near.centres, box.start, box.stop, strict=True)
        ]
        columns = _blend(_blend(near.values, 0, weights[0]), 1, weights[1])
        field = np.empty((*columns.shape[:2], len(weights[2].share)), np.float32)
        low, high, share = weights[2].low, weights[2].high, weights[2].share
        cuts = [0, *(np.flatnonzero(np.diff(low + high)) + 1).tolist(), len(share)]
        many = max(1, _AT_ONCE // max(1, field[:1].size))  # all planes in float64 would take GBs
        for z in range(0, len(field), many):
            some = columns[z : z + many]
            for x, end in pairwise(cuts):  # voxels x to end lie between the same two centres
                a, b = some[..., low[x], None], some[..., high[x], None]
                field[z : z + many, :, x:end] = a + (b - a) * share[x:end]
        return field

    def around(self, window: Box) -> "LatticeField":
        """Return the part of the field that influences a window, for the key of its unit."""
        keep = []
        for axis, centres in enumerate(self.centres):
            first = np.searchsorted(centres, window.start[axis], side="right") - 1
            last = np.searchsorted(centres, window.stop[axis] - 1, side="left")
            keep.append(slice(max(0, int(first)), int(last) + 1))
        z, y, x = (centres[part] for centres, part in zip(self.centres, keep, strict=True))
        return LatticeField((z, y, x), self.values[tuple(keep)])

    def to_json(self) -> dict[str, Any]:
        """Return the field as lists of numbers."""
        return {"centres": [list(axis) for axis in self.centres], "values": self.values.tolist()}

    @classmethod
    def __get_pydantic_core_schema__(cls, *_: Any) -> Any:
        """Let pydantic convert a field by `from_json` and `to_json`."""
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(
            lambda value: value if isinstance(value, cls) else cls.from_json(value),
            serialization=core_schema.plain_serializer_function_ser_schema(cls.to_json),
        )

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> "LatticeField":
        """Return the field from the lists of `to_json`."""
        z, y, x = (tuple(axis) for axis in content["centres"])
        return cls((z, y, x), np.array(content["values"], np.float64))


@dataclass(frozen=True, slots=True)
class _Weights:
    """Positions of voxels between centres: at `share` of the way from `low` to `high`.

    All arrays have one entry for each voxel; `low` and `high` are indices of centres.
    """

    low: NDArray[np.intp]
    high: NDArray[np.intp]
    share: NDArray[np.float64]


def _weights(centres: NDArray[np.float64], start: int, stop: int) -> _Weights:
    """Return the weights of voxels start..stop, or of the first one if there is only one centre."""
    voxels = np.arange(start, stop if len(centres) > 1 else start + 1, dtype=np.float64)
    below = np.searchsorted(centres, voxels, side="right") - 1
    low = np.clip(below, 0, len(centres) - 1)
    high = np.clip(below + 1, 0, len(centres) - 1)
    span = centres[high] - centres[low]
    inside = span > 0
    share = np.where(inside, (voxels - centres[low]) / np.where(inside, span, 1.0), 0.0)
    return _Weights(low, high, share)


def _blend(values: NDArray[np.float64], axis: int, weights: _Weights) -> NDArray[np.float64]:
    a, b = np.take(values, weights.low, axis=axis), np.take(values, weights.high, axis=axis)
    share = weights.share.reshape([-1 if i == axis else 1 for i in range(values.ndim)])
    blended: NDArray[np.float64] = a + (b - a) * share
    return blended


def make_iso_field(tiles: Sequence[Tile], found: Mapping[str, float | None]) -> LatticeField | None:
    """Return the field of one channel's iso-values; None if no tile has one.

    found  iso-value by tile ID, in voxel values; None: the tile takes the mean of the others
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
    return LatticeField((z, y, x), values)
