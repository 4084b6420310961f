"""The step that finds the objects in one tile's part of a label map."""

import base64
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

from stereocell.engine.step import Document, Step
from stereocell.model.tiling import Box
from stereocell.objects.extents import Extents, find_extents
from stereocell.steps.labels import LabelVoxels
from stereocell.steps.units_again import AGAIN

_DTYPES = {"labels": "<u8", "voxels": "<i8", "low": "<i8", "high": "<i8", "sums": "<f8"}


def extents_to_json(found: Extents) -> dict[str, str]:
    """Return the extents of a tile's objects as texts: little-endian numbers in base64."""
    return {
        name: base64.b64encode(getattr(found, name).astype(dtype).tobytes()).decode()
        for name, dtype in _DTYPES.items()
    }


def extents_from_json(content: Mapping[str, Any]) -> Extents:
    """Return the extents of a tile's objects from JSON that has passed its schema."""
    arrays = {
        field.name: np.frombuffer(base64.b64decode(content[field.name]), _DTYPES[field.name])
        for field in fields(Extents)
    }
    for name in ("low", "high", "sums"):
        arrays[name] = arrays[name].reshape(-1, 3)
    return Extents(**arrays)


@dataclass(frozen=True, slots=True)
class FindExtents(Step[Extents]):
    """Find the objects of one tile.

    box  voxels of the label map that belong to the tile; it may be empty
    """

    VERSION: ClassVar[int] = 1
    FORM: ClassVar[Document[Extents]] = Document(
        "units.schema.json#Extents", extents_to_json, extents_from_json, AGAIN
    )

    labels: LabelVoxels
    box: Box

    def run(self) -> Extents:
        """Return the objects in the tile's voxels. Raises SourceError."""
        if min(self.box.shape) == 0:
            return find_extents(np.zeros((0, 0, 0), np.uint8), self.box.start)
        return find_extents(self.labels.open().read(self.box), self.box.start)
