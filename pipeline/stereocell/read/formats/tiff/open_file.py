"""Open a TIFF file, and check that it is one and that it is complete.

tifffile reads a file without its end as one with fewer pages, or with zeros. So directories and
strips are compared with the size of the file. A file that was cut short is reported with the number
of bytes that it needs at least.

References: TIFF 6.0 section 2, https://www.awaresystems.be/imaging/tiff/bigtiff.html
"""

import os
import struct
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from typing import IO, Any, NoReturn

import fsspec
from tifffile import TiffFile, TiffFileError, TiffFrame, TiffPage, TiffPageSeries

from stereocell.model.errors import SourceError
from stereocell.read.formats.tiff.magic import MAGIC
from stereocell.read.formats.tiff.segments import require_segments
from stereocell.read.known_formats import identify
from stereocell.storage.first_bytes import HEAD_BYTES
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

MAX_PLANES = 1_000_000
SUFFIXES = (".tif", ".tiff", ".tf2", ".tf8", ".btf")
# bytes of a remote read; fsspec's default would read 5 MB ahead for every tile
_REMOTE_BLOCK = 1 << 18
_DESCRIPTION = 270  # tag ImageDescription, one byte per character
_MAX_TAGS = 4096  # tags of a directory; tifffile refuses more
_EXPECTED = "a complete TIFF file"


def open_tiff(location: Location, stack: ExitStack, **options: Any) -> TiffFile:
    """Return the open file; `stack` closes it.

    options  options of TiffFile. Formats in which tifffile opens other named files are off by
             default; a caller that has checked the names may turn them on

    Raises SourceError where it is not a TIFF, or where directories lie beyond its end.
    """
    where = location.shown
    options = {"is_ome": False, "is_mmstack": False, "is_ndtiff": False} | options
    with one_line(where, _EXPECTED):
        if location.is_local:  # opened by path, so that the files of a set find each other
            path = os.path.realpath(location.source)
            with open(path, "rb") as file:
                _require_tiff(where, file)
                require_directories(where, file, os.path.getsize(path))
            return stack.enter_context(TiffFile(path, **options))
        files, path = fsspec.url_to_fs(location.source, **location.storage_options)
        remote = files.open(path, "rb", block_size=_REMOTE_BLOCK, cache_type="blockcache")
        stack.callback(remote.close)
        _require_tiff(where, remote)
        remote.seek(0)
        try:
            return stack.enter_context(TiffFile(remote, **options))
        except TiffFileError as error:
            raise SourceError(f"{where}: {error}, expected {_EXPECTED}") from error


def _require_tiff(where: str, file: IO[bytes]) -> None:
    head = file.read(HEAD_BYTES)
    if not head.startswith(MAGIC):
        raise SourceError(f"{where}: found {identify(head).words}, expected TIFF")


def require_directories(where: str, file: IO[bytes], size: int) -> int:
    """Return the number of directories; 0 where they can't be counted here.

    Raises SourceError where their chain leads beyond the end of the file.

    file  open file, whose position changes
    size  size of the file in bytes
    """
    file.seek(0)
    head = file.read(16).ljust(16, b"\0")
    order = "<" if head[:2] == b"II" else ">"
    is_big = head[2:4] in (b"+\0", b"\0+")
    if not is_big and size >= 1 << 32:
        return 0  # 32-bit offsets have wrapped around; tifffile corrects them
    number, offset_bytes = ("Q", 8) if is_big else ("H", 4)
    link, entry = ("Q", 20) if is_big else ("I", 12)
    (offset,) = struct.unpack_from(order + link, head, 8 if is_big else 4)
    seen: set[int] = set()
    while offset and offset not in seen and len(seen) < MAX_PLANES:
        seen.add(offset)
        width = struct.calcsize(number)
        if offset + width > size:
            refuse_short(where, size, offset + width)
        file.seek(offset)
        (count,) = struct.unpack(order + number, file.read(width))
        if count > _MAX_TAGS:
            return 0  # tifffile refuses the directory
        end = offset + width + entry * count
        if len(seen) == 1:
            _require_description(where, size, file.read(entry * count), order, is_big=is_big)
        if end + offset_bytes > size:
            refuse_short(where, size, end + offset_bytes)
        file.seek(end)
        (offset,) = struct.unpack(order + link, file.read(offset_bytes))
    return len(seen)


def _require_description(
    where: str, size: int, entries: bytes, order: str, *, is_big: bool
) -> None:
    """Raise SourceError where the text of the first directory ends beyond the file.

    tifffile ignores such a text, so a file without its OME-XML would be read as plain TIFF.
    """
    form, inline = struct.Struct(order + ("HHQQ" if is_big else "HHII")), 8 if is_big else 4
    whole = entries[: len(entries) // form.size * form.size]
    for tag, _, count, offset in form.iter_unpack(whole):
        if tag == _DESCRIPTION and count > inline and offset + count > size:
            refuse_short(where, size, offset + count)


def refuse_short(where: str, size: int, needed: int) -> NoReturn:
    """Raise the SourceError for a file of `size` bytes that refers to byte `needed`."""
    raise SourceError(
        f"{where}: cut short at byte {size} of {needed} or more, expected the complete file "
        "(copy or download it again)"
    )


def require_pages(
    where: str, tiff: TiffFile, pages: Sequence[TiffPage | TiffFrame | None], expected: int
) -> None:
    """Raise SourceError for missing planes, which tifffile would read as zeros, or a short file.

    expected  number of planes
    """
    present = [page for page in pages if page is not None]
    if len(present) < expected:
        raise SourceError(
            f"{where}: found {len(present)} planes, expected {expected} "
            "(the file is cut short, or a file of the set is missing)"
        )
    for page in present:
        named = where if page.parent is tiff else f"{where}: {page.parent.filename!r:.100}"
        if page.dataoffsets and page.databytecounts:
            end = max(a + b for a, b in zip(page.dataoffsets, page.databytecounts, strict=False))
            size = page.parent.filehandle.size
            if end > size:
                refuse_short(named, size, end)
    require_segments(where, tiff, present)


def files_of(location: Location, pages: Iterable[Any]) -> tuple[str, ...]:
    """Return the paths of the files that hold the pages; empty: the source is at an address."""
    if not location.is_local:
        return ()
    paths = {page.parent.filehandle.path for page in pages if page is not None}
    return tuple(sorted({location.path, *map(str, paths)}))


def note_absent(levels: Iterable[Iterable[Any]]) -> tuple[str, ...]:
    """Return a note for each level with strips or tiles without bytes, which are read as 0.

    levels  pages of each level, the finest first

    Writers leave out empty tiles (GDAL calls such a file sparse), and a lost tile looks the same.
    """
    found = []
    for index, pages in enumerate(levels):
        counts = [count for page in pages if page is not None for count in page.databytecounts]
        if absent := counts.count(0):
            share = max(absent / len(counts), 1e-4)
            found.append(
                f"{f'level {index}: ' if index else ''}{absent} of {len(counts)} strips or tiles "
                f"({share:.2%}) are not stored: read as 0, which the format uses for empty ones; "
                "they may be lost"
            )
    return tuple(found)


def require_series(where: str, tiff: TiffFile, series: TiffPageSeries) -> None:
    """Raise SourceError where a series lacks planes. They may all lie in one block after a page."""
    pages = list(series.pages)
    of_one = max(series.keyframe.size, 1)
    if len(pages) == 1 and series.dataoffset is not None:
        end = series.dataoffset + series.size * series.dtype.itemsize
        if end > tiff.filehandle.size:
            refuse_short(where, tiff.filehandle.size, end)
        return
    require_pages(where, tiff, pages, -(-series.size // of_one))
