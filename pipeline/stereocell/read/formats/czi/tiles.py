"""Compare each entry in the directory of a CZI file with its copy at the tile.

libCZI places a tile by the directory, and decodes it by the copy. If the two entries of a tile
differ, it is drawn at a wrong size or place. Neither entry has a checksum.

Reference: ZISRAW (CZI) File Format, "SubBlockDirectory" and "DirectoryEntryDV"
"""

import struct
from collections import Counter
from dataclasses import dataclass
from typing import BinaryIO

from stereocell.model.errors import SourceError

SEGMENT = struct.Struct("<16s2q")  # name of a segment, its length, and the used length
_COUNT = struct.Struct("<i")  # number of entries, at the start of a directory
_COUNT_BYTES = 128  # bytes of the count and of the reserved bytes after it
_ENTRY = struct.Struct("<2siqiiB5si")  # schema, pixel type, place, part, packing, pyramid, -, axes
_AXIS = struct.Struct("<4siifi")  # name, start, size, coordinate, stored size
_SIZES = struct.Struct("<iiq")  # sizes of a tile's metadata, attachment and voxels
_DIRECTORY, _TILE = b"ZISRAWDIRECTORY", b"ZISRAWSUBBLOCK"
_SCHEMA = b"DV"  # entries with any number of axes; DE, in early files, has a fixed form
_MOST_AXES = 64
_PLANE = "CTZ"
_COMPARED = "CSTXYZ"  # axes that determine which voxels are read: channel, scene, time and position


@dataclass(frozen=True, slots=True)
class _Entry:
    """The fields of an entry that determine which voxels a tile holds.

    axes  name, start, size and stored size of each axis in _COMPARED
    """

    place: int
    pixel_type: int
    packing: int
    axes: tuple[tuple[str, int, int, int], ...]

    @property
    def plane(self) -> tuple[int, ...]:
        starts = {name: start for name, start, _, _ in self.axes}
        return tuple(starts.get(axis, 0) for axis in _PLANE)

    @property
    def scene(self) -> int:
        return next((start for name, start, _, _ in self.axes if name == "S"), 0)

    @property
    def is_finest(self) -> bool:
        """Whether the tile belongs to the finest level: its stored size is its shown size."""
        return all(size == stored for name, _, size, stored in self.axes if name in "XY")


class CziTiles:
    """The entries of a directory, by plane. The tiles of a plane are compared once.

    at  byte at which the directory begins in the file

    `counts` has the number of tiles of the finest level, by scene and plane (c, t, z); it is empty
    for an early file.
    """

    def __init__(self, path: str, at: int, where: str) -> None:
        self._path, self._where = path, where
        self._waiting: dict[tuple[int, ...], list[_Entry]] = {}
        with open(path, "rb") as file:
            entries = _entries(file, at)
        for entry in entries:
            self._waiting.setdefault(entry.plane, []).append(entry)
        self.counts = Counter((one.scene, one.plane) for one in entries if one.is_finest)

    def require_plane(self, plane: dict[str, int]) -> None:
        """Raise SourceError where a tile of a plane differs from its entry in the directory."""
        key = tuple(plane.get(axis, 0) for axis in _PLANE)
        if key not in self._waiting:
            return
        with open(self._path, "rb") as file:
            for entry in self._waiting[key]:
                copy = _copy(file, entry.place)
                if copy != entry:
                    raise SourceError(
                        f"{self._where}: tile at byte {entry.place}: found {_shown(copy, entry)}, "
                        f"expected {_shown(entry, copy)} as in the directory: the file is "
                        "damaged: copy or download it again"
                    )
        del self._waiting[key]


def _entries(file: BinaryIO, at: int) -> list[_Entry]:
    """Return the entries of a directory; empty for an early file (DE), which is not compared.

    Raises ValueError or struct.error where the directory is incomplete.
    """
    file.seek(at)
    name, _, used = SEGMENT.unpack(file.read(SEGMENT.size))
    content = file.read(max(0, used))
    if name.rstrip(b"\0") != _DIRECTORY or len(content) < _COUNT_BYTES:
        raise ValueError(f"found no directory of tiles at byte {at}")
    (count,) = _COUNT.unpack_from(content)
    if content.startswith(b"DE", _COUNT_BYTES):
        return []
    entries, start = [], _COUNT_BYTES
    for _ in range(count):
        entry, start = _entry(content, start)
        entries.append(entry)
    return entries


def _entry(content: bytes, start: int) -> tuple[_Entry, int]:
    """Return the entry at an offset, and the offset after it.

    Raises ValueError and struct.error.
    """
    schema, kind, place, _, packing, _, _, count = _ENTRY.unpack_from(content, start)
    if schema != _SCHEMA or not 0 <= count <= _MOST_AXES:
        raise ValueError(f"found no entry of a tile (DV) at byte {start} of its segment")
    start += _ENTRY.size
    axes = []
    for at in range(start, start + count * _AXIS.size, _AXIS.size):
        name, first, size, _, stored = _AXIS.unpack_from(content, at)
        title = name.rstrip(b"\0 ").decode("ascii", "replace")
        if title in _COMPARED:
            axes.append((title, first, size, stored))
    return _Entry(place, kind, packing, tuple(sorted(axes))), start + count * _AXIS.size


def _copy(file: BinaryIO, place: int) -> _Entry:
    """Return the copy of an entry at its tile. Raises ValueError where there is no tile."""
    file.seek(max(0, place))
    head = file.read(SEGMENT.size + _SIZES.size + _ENTRY.size + _MOST_AXES * _AXIS.size)
    if head[: len(_TILE) + 1] != _TILE + b"\0":
        raise ValueError(f"found no tile at byte {place}")
    entry, _ = _entry(head, SEGMENT.size + _SIZES.size)
    return _Entry(place, entry.pixel_type, entry.packing, entry.axes)


def _shown(entry: _Entry, other: _Entry) -> str:
    """Return the fields in which an entry differs from another one, in words."""
    parts = [
        f"axis {name} start {start}, size {size}, stored size {stored}"
        for name, start, size, stored in sorted(set(entry.axes) - set(other.axes))
    ]
    if entry.pixel_type != other.pixel_type:
        parts.append(f"pixel type {entry.pixel_type}")
    if entry.packing != other.packing:
        parts.append(f"compression {entry.packing}")
    return "; ".join(parts)[:200] or "no other axis"
