"""Find the objects in one tile's part of a label map, on a worker. Picklable."""

import base64
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from stereocell.building.label_maps import Labels
from stereocell.model.tiling import Box
from stereocell.objects.extents import Extents, find_extents
from stereocell.storage.json_files import write_sealed

_DTYPES = {"labels": "<u8", "voxels": "<i8", "low": "<i8", "high": "<i8", "sums": "<f8"}


@dataclass(frozen=True, slots=True)
class ExtentsTask:
    """One tile; `box`: its voxels of the label map, which may be none."""

    labels: Labels
    box: Box


def find_in_tile(task: ExtentsTask) -> Extents:
    """Return the objects in a tile's voxels. Raises SourceError."""
    if min(task.box.shape) == 0:
        return find_extents(np.zeros((0, 0, 0), np.uint8), task.box.start)
    return find_extents(task.labels.open().read(task.box), task.box.start)


def write_extents(task_and_file: tuple[ExtentsTask, Path]) -> None:
    """Find the objects and write where they are. Raises SourceError."""
    task, file = task_and_file
    found = find_in_tile(task)
    packed = {
        name: base64.b64encode(getattr(found, name).astype(dtype).tobytes()).decode()
        for name, dtype in _DTYPES.items()
    }
    write_sealed(file, packed)


def extents_from_json(content: Mapping[str, Any]) -> Extents:
    """Return the objects of a tile; `content` has passed its schema."""
    arrays = {
        field.name: np.frombuffer(base64.b64decode(content[field.name]), _DTYPES[field.name])
        for field in fields(Extents)
    }
    for name in ("low", "high", "sums"):
        arrays[name] = arrays[name].reshape(-1, 3)
    return Extents(**arrays)
