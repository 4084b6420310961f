"""Pieces of a CT scan that do not belong to the body, and are left out of surface and volume."""

import base64
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stereocell.model.tiling import Box

AIR_HU = -1000.0  # value of the voxels that are left out


@dataclass(frozen=True, slots=True)
class Holder:
    """Pieces that are left out.

    region  voxels (z, y, x) of the level that is built
    mask    bool (z, y, x), cells that cover the region evenly: True near a piece that is left out
    pieces  the size of each piece, as text
    """

    WORDS: ClassVar[str] = "as no part of the body (a table, holder, pad or cable)"

    region: Box
    mask: NDArray[np.bool_]
    pieces: tuple[str, ...]

    def at(self, box: Box) -> NDArray[np.bool_]:
        """Return which voxels of a box are left out, bool (z, y, x)."""
        return self._at(_indices(box))

    def left_out_of(self, voxels: NDArray[Any], box: Box) -> NDArray[Any]:
        """Return a box's voxels (z, y, x) with air at the left-out places, in the same dtype."""
        return self.left_out_at(voxels, _indices(box))

    def left_out_at(self, voxels: NDArray[Any], places: Sequence[NDArray[Any]]) -> NDArray[Any]:
        """Return a grid's voxels with air at the left-out places.

        voxels  (z, y, x)
        places  coordinates of the grid along z, y and x, in voxels of the region's level
        """
        air = np.minimum(voxels, np.asarray(AIR_HU).astype(voxels.dtype))
        return np.where(self._at(places), air, voxels)

    def around(self, box: Box) -> "Holder | None":
        """Return this holder if it leaves out voxels of a box, else None."""
        return self if self.at(box).any() else None

    def _at(self, places: Sequence[NDArray[Any]]) -> NDArray[np.bool_]:
        cells = [
            np.clip((along - first) * count // (last - first), 0, count - 1).astype(np.intp)
            for along, first, last, count in zip(
                places, self.region.start, self.region.stop, self.mask.shape, strict=True
            )
        ]
        return np.asarray(self.mask[np.ix_(*cells)])

    def to_json(self) -> dict[str, Any]:
        """Return the holder as JSON values; the mask as bits, compressed by zlib, in base64."""
        packed = zlib.compress(np.packbits(self.mask).tobytes(), 6)
        return {
            "region": [list(self.region.start), list(self.region.stop)],
            "shape": list(self.mask.shape),
            "mask": base64.b64encode(packed).decode(),
            "pieces": list(self.pieces),
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> "Holder":
        """Return the holder from the result of `to_json`."""
        shape = tuple(content["shape"])
        bits = np.frombuffer(zlib.decompress(base64.b64decode(content["mask"])), np.uint8)
        count = int(np.prod(shape, dtype=np.int64))
        start, stop = (tuple(end) for end in content["region"])
        mask = np.unpackbits(bits, count=count).reshape(shape).astype(bool)
        return cls(Box(start, stop), mask, tuple(content["pieces"]))

    @classmethod
    def __get_pydantic_core_schema__(cls, *_: Any) -> Any:
        """Let pydantic read by `from_json` and write by `to_json`."""
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(
            lambda value: value if isinstance(value, cls) else cls.from_json(value),
            serialization=core_schema.plain_serializer_function_ser_schema(cls.to_json),
        )


def _indices(box: Box) -> list[NDArray[np.intp]]:
    """Return the indices of a box's voxels along each axis."""
    return [np.arange(a, b) for a, b in zip(box.start, box.stop, strict=True)]
