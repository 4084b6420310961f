"""An open CZI file, read with pylibCZIrw. The object lives in a child process (image.py)."""

import os
import struct
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.formats.czi.tiles import SEGMENT, CziTiles
from stereocell.storage.library_errors import one_line

_PLACES = struct.Struct("<2q")  # byte offsets of the directory of tiles and of the metadata
_PLACES_AT = 84  # byte offset of these two numbers in the file
Rectangle = tuple[int, int, int, int]  # x, y, width, height


@dataclass(frozen=True, slots=True)
class CziMetadata:
    """The metadata of a file.

    bounds    first index and the index after the last one, by axis
    types     pixel types, by channel
    scenes    numbers and rectangles of the scenes; empty: the file has no scenes
    metadata  XML
    tiles     number of tiles of the finest level, by scene and plane (c, t, z); empty: an early
              file, whose tiles are not counted
    """

    bounds: dict[str, tuple[int, int]]
    types: tuple[str, ...]
    scenes: tuple[tuple[int, Rectangle], ...]
    metadata: str
    tiles: dict[tuple[int, tuple[int, ...]], int]


class CziFile:
    """An open file. Raises SourceError where it can't be opened."""

    def __init__(self, path: str, where: str) -> None:
        import pylibCZIrw.czi as library

        self._where = where
        with one_line(where, "a complete CZI file"):
            path = os.path.realpath(path)
            directory = _require_whole(path, where)
            self._tiles = CziTiles(path, directory, where)
            self._opened = library.open_czi(path)
            self._file = self._opened.__enter__()

    def metadata(self) -> CziMetadata:
        """Return the file's metadata. Raises SourceError."""
        with one_line(self._where, "a complete CZI file"):
            scenes = sorted(self._file.scenes_bounding_rectangle.items())
            return CziMetadata(
                bounds=dict(self._file.total_bounding_box),
                types=tuple(str(kind) for _, kind in sorted(self._file.pixel_types.items())),
                scenes=tuple((index, (box.x, box.y, box.w, box.h)) for index, box in scenes),
                metadata=self._file.raw_metadata,
                tiles=dict(self._tiles.counts),
            )

    def read(self, window: Rectangle, plane: dict[str, int], scene: int | None) -> NDArray[Any]:
        """Return the pixels of a window of a plane. Raises SourceError."""
        with one_line(self._where, "undamaged planes"):
            self._tiles.require_plane(plane)
            voxels: NDArray[Any] = self._file.read(roi=window, plane=plane, scene=scene)
            return voxels[..., 0]


def _require_whole(path: str, where: str) -> int:
    """Return the byte at which the directory of tiles begins.

    Raises SourceError where the file ends before the directory or the metadata, which most writers
    write last.
    """
    size, directory = os.path.getsize(path), 0
    with open(path, "rb") as file:
        file.seek(_PLACES_AT)
        head = file.read(_PLACES.size)
        needed = _PLACES_AT + _PLACES.size
        if len(head) == _PLACES.size:
            needed = 0
            places = _PLACES.unpack(head)
            directory = places[0]
            for place in places:
                if place <= 0:
                    continue
                file.seek(place)
                segment = file.read(SEGMENT.size)
                length = SEGMENT.unpack(segment)[2] if len(segment) == SEGMENT.size else 0
                needed = max(needed, place + SEGMENT.size + max(0, length))
    if needed > size:
        raise SourceError(
            f"{where}: cut short at byte {size} of {needed} or more, expected a complete CZI file "
            "(copy or download it again)"
        )
    return directory
