"""Check the frames of an ND2 file with the map of chunks at the end of the file.

The library nd2 returns zeros for a frame that the map does not list, and for one beyond the end of
the file. It reads an uncompressed frame without checking the chunk's own header. So each frame is
compared with the map and with its header before it is read.

A file of version 2 or later is a chain of chunks. Each has a mark, the lengths of name and data,
the name and the data. The map lists the chunks' names, places and sizes. Older files are JPEG 2000.
"""

import os
import struct
from collections.abc import Sequence
from typing import BinaryIO

from stereocell.model.errors import SourceError
from stereocell.storage.library_errors import one_line

BEGIN = b"\xda\xce\xbe\n"  # mark at the start of each chunk, and so of the file
_HEAD = struct.Struct("<4sIQ")  # mark, length of the name, length of the data
_PLACE = struct.Struct("<2Q")  # entry of the map: byte at which a chunk begins, and its size
_END = struct.Struct("<32sQ")  # last bytes of a file: signature, byte at which the map begins
_END_MARK, _MAP_MARK = b"ND2 CHUNK MAP SIGNATURE 0000001!", b"ND2 FILEMAP SIGNATURE NAME 0001!"
_FRAME = b"ImageDataSeq|"
_TIME = 8  # bytes of the time stamp before the voxels of a frame
_VOXELS_AT = 4096  # bytes from a frame's header to its voxels, the value that nd2 uses
_MAX_MAP = 1 << 30  # bytes; a larger map is refused


class Nd2Frames:
    """The frames that the map of a file lists. A JPEG 2000 file has no map.

    frame_bytes  bytes of a frame's voxels; 0: they are compressed
    """

    def __init__(self, path: str, where: str, frame_bytes: int) -> None:
        self._path, self._where, self._frame_bytes = path, where, frame_bytes
        self._size = os.path.getsize(path)
        self._places: dict[int, int] | None = None
        self._sound: set[int] = set()
        with one_line(where, "a complete ND2 file"), open(path, "rb") as file:
            if file.read(len(BEGIN)) == BEGIN:
                self._places = dict(self._listed(file))

    def missing(self, numbers: Sequence[int]) -> list[int]:
        """Return the numbers of the frames that the file lacks, among those given."""
        return [] if self._places is None else [n for n in numbers if n not in self._places]

    def require(self, number: int) -> None:
        """Raise SourceError where a frame is missing, or is not where the map of chunks says."""
        if self._places is None or number in self._sound:
            return
        if number not in self._places:
            raise SourceError(
                f"{self._where}: found no frame {number}, expected it: the acquisition ended "
                "early, or the file is damaged"
            )
        name, place = _FRAME + b"%d!" % number, self._places[number]
        with open(self._path, "rb") as file:
            file.seek(place)
            head = file.read(_HEAD.size + len(name))
        mark, name_bytes, data_bytes = _HEAD.unpack(head[: _HEAD.size].ljust(_HEAD.size, b"\0"))
        end = place + _HEAD.size + name_bytes + data_bytes
        found = ""
        if mark != BEGIN or head[_HEAD.size :] != name:
            found = "another chunk"
        elif end > self._size:
            found = f"{self._size} bytes in the file, where the frame ends at {end}"
        elif self._frame_bytes and _HEAD.size + name_bytes + _TIME != _VOXELS_AT:
            found = f"a name of {name_bytes} bytes"
        elif data_bytes < _TIME + self._frame_bytes:
            found = f"{data_bytes} bytes, fewer than its {_TIME + self._frame_bytes}"
        if found:
            raise SourceError(
                f"{self._where}: frame {number} at byte {place}: found {found}, expected the frame "
                "as in the map of chunks: the file is damaged: copy or download it again"
            )
        self._sound.add(number)

    def _listed(self, file: BinaryIO) -> list[tuple[int, int]]:
        """Return the number and first byte of each frame, from the map at the file's end.

        Raises OSError and struct.error.
        """
        file.seek(max(0, self._size - _END.size))
        signature, place = _END.unpack(file.read(_END.size))
        if signature != _END_MARK or place >= self._size:
            raise OSError("found no map of its chunks")
        file.seek(place)
        mark, name_bytes, data_bytes = _HEAD.unpack(file.read(_HEAD.size))
        name = file.read(min(name_bytes, _VOXELS_AT))
        if mark != BEGIN or not name.startswith(_MAP_MARK) or data_bytes > _MAX_MAP:
            raise OSError(f"found no map of its chunks at byte {place}")
        content, found, at = file.read(data_bytes), [], 0
        while not content.startswith(_END_MARK, at):
            end = content.find(b"!", at) + 1
            if not end:
                raise OSError("the map of its chunks is cut short")
            entry = content[at:end]
            if entry.startswith(_FRAME):
                found.append((int(entry[len(_FRAME) : -1]), _PLACE.unpack_from(content, end)[0]))
            at = end + _PLACE.size
        return found
