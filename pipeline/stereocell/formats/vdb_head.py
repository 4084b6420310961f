"""Read what an OpenVDB file says of its grids, and not their voxels: names and transforms.

The layout is in write/vdb.py. Formats before 222 lay out their head in another way.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.vdb import check_vdb
from stereocell.model.errors import StageError

_OLDEST_FORMAT = 222
_MAPS = {"ScaleTranslateMap", "UniformScaleTranslateMap"}


@dataclass(frozen=True, slots=True)
class VdbGrid:
    """One grid. Its map is None where it is no plain scale and shift.

    spacing  (3,) distance between voxels along x, y, z, in the file's units
    origin   (3,) where voxel (0, 0, 0) has its centre
    """

    name: str
    spacing: NDArray[np.float64] | None
    origin: NDArray[np.float64] | None


def read_vdb_head(path: Path) -> list[VdbGrid]:
    """Return the grids of a file, in its order; none for a format that isn't known.

    Raises StageError if the file is missing or damaged.
    """
    check_vdb(path)
    try:
        return _read(path)
    except (struct.error, ValueError, OSError) as error:
        raise StageError(f"{path}: can't be read as OpenVDB: {error}") from None


def _read(path: Path) -> list[VdbGrid]:
    with path.open("rb") as file:
        file.seek(8)
        version, _, _, has_offsets = struct.unpack("<III?", file.read(13))
        if version < _OLDEST_FORMAT or not has_offsets:
            return []
        file.seek(36, 1)  # UUID
        _skip_metadata(file)
        (count,) = struct.unpack("<i", file.read(4))
        return list(_read_grids(file, count))


def _read_grids(file: BinaryIO, count: int) -> Iterator[VdbGrid]:
    for _ in range(count):
        name, _, _ = _text(file), _text(file), _text(file)  # tree type, instance parent
        start, _, end = struct.unpack("<3q", file.read(24))
        file.seek(start + 4)  # compression flags
        _skip_metadata(file)
        spacing = origin = None
        if _text(file) in _MAPS:
            numbers = np.frombuffer(file.read(48), dtype="<f8")
            origin, spacing = numbers[:3], numbers[3:]
        # a grid that shares its name with another has a counter behind a separator
        yield VdbGrid(name.split("\x1e")[0], spacing, origin)
        file.seek(end)


def _skip_metadata(file: BinaryIO) -> None:
    (entries,) = struct.unpack("<I", file.read(4))
    for _ in range(3 * entries):  # name, type and value, each behind its length
        _text(file)


def _text(file: BinaryIO) -> str:
    (length,) = struct.unpack("<I", file.read(4))
    return file.read(length).decode("utf-8", "replace")
