"""One file of a folder of planes: its head and its pixels, by its format."""

import os
import struct
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import imagecodecs
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from stereocell.model.errors import SourceError
from stereocell.read.formats.planes.endings import BMP, JPEG, PNG, TIFF
from stereocell.read.formats.planes.head import Head
from stereocell.read.formats.planes.tiff_head import tiff_head
from stereocell.read.formats.tiff.open_file import open_tiff
from stereocell.read.formats.tiff.orientation import turn_by, turn_of, turned_pixels
from stereocell.read.known_formats import identify
from stereocell.storage.first_bytes import HEAD_BYTES
from stereocell.storage.library_errors import collected_log, one_line
from stereocell.storage.location import Location

_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
# bytes at the end of a PNG that are searched for its last chunk, since programs may append others
_TAIL = 1024
_PNG_SAMPLES = {0: 1, 2: 3, 4: 2, 6: 4}  # samples by colour type; type 3, a palette, is refused
_EXIF_ORIENTATION = 274  # tag of TIFF and EXIF
_SAMPLES = {"L": 1, "RGB": 3}  # samples of a pixel by pillow's mode; other modes are refused


def read_head(path: str, named: str) -> Head:
    """Return what a file states; no pixels are decoded. Raises SourceError."""
    with collected_log("tifffile"), one_line(named, "a complete image"):
        return _FORMATS[_kind(path)].head(path, named)


def read_plane(path: str, named: str) -> NDArray[Any]:
    """Return the pixels, (rows, columns, samples), in the file's dtype. Raises SourceError."""
    with collected_log("tifffile"), one_line(named, "a complete image"):
        found = _FORMATS[_kind(path)].plane(path, named)
    return found[..., None] if found.ndim == 2 else found


def _kind(path: str) -> str:
    lower = path.lower()
    return next(kind for kind, endings in _ENDINGS.items() if lower.endswith(endings))


def _tiff_plane(path: str, named: str) -> NDArray[Any]:
    with ExitStack() as stack:
        page = open_tiff(Location(path, True), stack).pages.first
        pixels = page.asarray()
        is_planar = page.samplesperpixel > 1 and page.planarconfig == 2
        pixels = np.moveaxis(pixels, 0, -1) if is_planar else pixels
        return turned_pixels(pixels, turn_of(page)[0])


def _png_head(path: str, named: str) -> Head:
    head = _begin(path, named, _PNG_MAGIC, "PNG")
    if len(head) < 33:
        raise SourceError(f"{named}: cut short at byte {len(head)}, expected the whole file")
    columns, rows, bits, colour = struct.unpack(">2I2B", head[16:26])
    if colour not in _PNG_SAMPLES:
        raise SourceError(f"{named}: found a palette, expected grey or RGB pixels")
    _require_end(path, named)
    if not (rows and columns):
        raise SourceError(f"{named}: found {columns} x {rows} pixels, expected at least one")
    return Head(
        (rows, columns, _PNG_SAMPLES[colour]), np.dtype(np.uint16 if bits == 16 else np.uint8)
    )


def _require_end(path: str, named: str) -> None:
    """Raise SourceError for a PNG without its last chunk."""
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        file.seek(max(0, size - _TAIL))
        if b"IEND" not in file.read():
            raise SourceError(
                f"{named}: cut short at byte {size}, expected the whole file (copy or download it "
                "again)"
            )


def _png_plane(path: str, named: str) -> NDArray[Any]:
    # pillow would cut 16-bit RGB to 8 bits.
    with open(path, "rb") as file:
        return np.asarray(imagecodecs.png_decode(file.read()))


def _jpeg_head(path: str, named: str) -> Head:
    _begin(path, named, b"\xff\xd8", "JPEG")
    return _pillow_head(path, named)


def _bmp_head(path: str, named: str) -> Head:
    _begin(path, named, b"BM", "BMP")
    return _pillow_head(path, named)


def _pillow_head(path: str, named: str) -> Head:
    """Return what a file states that pillow decodes; pillow reads a palette of greys as grey."""
    try:
        with Pillow.open(path) as image:
            turn, notes = turn_by(image.getexif().get(_EXIF_ORIENTATION, 1))
            sizes = (0, *image.size[::-1])
            _, rows, columns = (sizes[axis] for axis in turn.order)
            mode = image.mode
    except Pillow.DecompressionBombError as error:
        raise SourceError(f"{named}: {error!s:.100}, expected a smaller image") from error
    if mode not in _SAMPLES:
        raise SourceError(f"{named}: found pixels of kind {mode}, expected grey or RGB")
    shape = (rows, columns, _SAMPLES[mode])
    return Head(shape, np.dtype(np.uint8), notes=notes)


def _pillow_plane(path: str, named: str) -> NDArray[Any]:
    with Pillow.open(path) as image:
        turn, _ = turn_by(image.getexif().get(_EXIF_ORIENTATION, 1))
        return turned_pixels(np.asarray(image), turn)


def _begin(path: str, named: str, magic: bytes, title: str) -> bytes:
    with open(path, "rb") as file:
        head = file.read(HEAD_BYTES)
    if not head.startswith(magic):
        raise SourceError(f"{named}: found {identify(head).words}, expected {title}")
    return head


@dataclass(frozen=True, slots=True)
class _Format:
    head: Callable[[str, str], Head]
    plane: Callable[[str, str], NDArray[Any]]


_FORMATS = {
    "tiff": _Format(tiff_head, _tiff_plane),
    "png": _Format(_png_head, _png_plane),
    "jpeg": _Format(_jpeg_head, _pillow_plane),
    "bmp": _Format(_bmp_head, _pillow_plane),
}
_ENDINGS = {"tiff": TIFF, "png": PNG, "jpeg": JPEG, "bmp": BMP}


def join(folder: str, path: str) -> str:
    """Return the path on the disk of a file that is named relative to a folder, with `/`."""
    return os.path.join(folder, *path.split("/"))
