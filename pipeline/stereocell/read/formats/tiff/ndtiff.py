"""Read Micro-Manager's NDTiff: TIFF files, and an index of axes and places of images.

An index that was cut short lists fewer images, and tifffile returns only those. So the images in
each file are counted and compared with the index. Files of the set that the index doesn't name are
searched too.

References: https://github.com/micro-manager/NDTiffStorage
"""

import os
import struct
from collections import Counter
from collections.abc import Mapping
from contextlib import ExitStack

import tifffile
from tifffile import TiffFile

from stereocell.model.errors import SourceError
from stereocell.read.formats.tiff.open_file import open_tiff, require_directories
from stereocell.storage.location import Location, require_own

INDEX = "NDTiff.index"
_MAX_INDEX = 64 << 20  # bytes; a larger index is ignored
_MARK = struct.pack("<I", 483729)  # mark at byte 8 of each file of a set
_MARK_AT = 8


def with_index(
    location: Location, tiff: TiffFile, stack: ExitStack
) -> tuple[TiffFile, tuple[str, ...]]:
    """Return the file opened with the index beside it, which names axes and other files.

    Without an index, the file is returned unchanged. The second value holds the names of channels
    in the index. Raises SourceError where the index lists fewer images than the files hold.
    """
    index = index_of(location)
    folder = os.path.dirname(index)
    if not location.is_local or not tiff.is_micromanager or not os.path.exists(index):
        return tiff, ()
    found = require_own(index, [location.folder], named=f"{location.shown}: {INDEX}")
    if found is None or found.st_size > _MAX_INDEX:
        return tiff, ()
    rows = list(tifffile.read_ndtiff_index(index))
    for name in dict.fromkeys(row[1] for row in rows):
        named = f"{location.shown}: {INDEX}: {name!r:.200}"
        require_own(os.path.join(folder, name), [location.folder], named=named)
    _require_all(location, folder, Counter(row[1] for row in rows))
    # tifffile numbers channels in the order of their first planes.
    channels = dict.fromkeys(row[0].get("channel") for row in rows)
    names = tuple(name for name in channels if isinstance(name, str))
    return open_tiff(location, stack, is_ndtiff=None), names


def index_of(location: Location) -> str:
    """Return the path of the index beside a file; the index may be missing."""
    return os.path.join(os.path.dirname(os.path.realpath(location.path)), INDEX)


def _require_all(location: Location, folder: str, listed: Mapping[str, int]) -> None:
    """Raise SourceError where the files of the set hold more images than the index lists.

    listed  number of images in the index, by file
    """
    held = {name: _images_in(location, os.path.join(folder, name)) for name in listed}
    for name in sorted(os.listdir(folder)):
        path = os.path.join(folder, name)
        if name not in listed and name.lower().endswith((".tif", ".tiff")) and _is_marked(path):
            held[name] = _images_in(location, path)
    total = sum(max(count, listed.get(name, 0)) for name, count in held.items())
    for name, count in held.items():
        if count > listed.get(name, 0):
            raise SourceError(
                f"{location.shown}: {INDEX}: found {sum(listed.values())} of {total} images "
                f"({listed.get(name, 0)} of {count} in {name!r:.100}), expected all of them: the "
                "index is cut short or belongs to another set: copy it again"
            )


def _images_in(location: Location, path: str) -> int:
    with open(path, "rb") as file:
        return require_directories(f"{location.shown}: {path}", file, os.path.getsize(path))


def _is_marked(path: str) -> bool:
    """Return whether a file has NDTiff's mark in its first bytes."""
    if not os.path.isfile(path):
        return False
    with open(path, "rb") as file:
        return file.read(_MARK_AT + len(_MARK))[_MARK_AT:] == _MARK
