"""TIFF: OME-TIFF, and what ImageJ, Zeiss LSM, MetaMorph, Micro-Manager, tifffile and others write.

read/tiff/ome.py reads what OME-XML describes, read/tiff/plain.py all else; both by tifffile.
"""

import logging
import os
import re
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace

from tifffile import TiffFile

from stereocell.model.errors import SourceError
from stereocell.read import ome_xml
from stereocell.read.image import Image
from stereocell.read.tiff.ome import read_ome
from stereocell.read.tiff.open_file import open_tiff, refuse_short
from stereocell.read.tiff.plain import kind_of, read_plain
from stereocell.storage.library_errors import collected_log, one_line
from stereocell.storage.location import Location, require_own

logging.getLogger("tifffile").addHandler(logging.NullHandler())  # errors are raised here
_OME_NAMES = (".ome.tif", ".ome.tiff", ".ome.tf2", ".ome.tf8", ".ome.btf")
_COMPANION = ".companion.ome"
_BEYOND = re.compile(r"invalid page offset ([0-9]+)")  # tifffile's words
_HEAD = 4096  # characters of a description, in which OME-XML names itself, whole or not
_MAX_COMPANION = 64 << 20  # bytes of an OME-XML beside the TIFF files


def read_image(location: Location, axes: str = "") -> Image:
    """Return the first image of the file.

    axes  of those longer than 1, slowest first, as `zcyx`; empty: the file's own

    Raises SourceError where the file can't be read as an image, UsageError where it has another
    number of axes.
    """
    if location.parts[-1].lower().endswith(_COMPANION):
        location = _first_of_set(location)
    where = location.shown
    stack = ExitStack()
    try:
        with collected_log("tifffile") as log:
            tiff = open_tiff(location, stack)
            with one_line(where, "a TIFF file, whole"):
                text = tiff.pages.first.description
            if not _is_ome(text):
                image = read_plain(location, tiff, stack, axes)
                _require_pages_read(location, tiff, log)
                return _with_note(location, image)
            try:
                root = ome_xml.parse(text, where)
            except SourceError as error:
                raise SourceError(f"{error}{_otherwise(tiff)}") from error
            companion = ome_xml.companion_of(root)
            if companion:
                text = _companion(location, companion)
                root = ome_xml.parse(text, f"{where}: {companion!r:.100}")
                tiff = open_tiff(location, stack, omexml=text)
            image = read_ome(location, tiff, stack, root=root, text=text, log=log, axes=axes)
            beside = [os.path.join(location.folder, companion)] if companion else []
            return replace(image, files=(*image.files, *beside))
    except BaseException:
        stack.close()
        raise


def _require_pages_read(location: Location, tiff: TiffFile, log: Sequence[str]) -> None:
    """Raise SourceError where tifffile left out pages behind the end of a file at an address."""
    for message in log:
        found = _BEYOND.search(message)
        if found:
            refuse_short(location.shown, tiff.filehandle.size, int(found[1]))


def _first_of_set(location: Location) -> Location:
    """Return the first TIFF file of a set that is named by its OME-XML. Raises SourceError."""
    where = location.shown
    if not location.is_local:
        raise SourceError(f"{where}: found OME-XML at an address, expected the set on this machine")
    root = ome_xml.parse(_text_of(location.source, where), where)
    name = next(ome_xml.files_of(root), "")
    path = os.path.join(location.folder, name)
    if not name or require_own(path, [location.folder], named=f"{where}: {name!r:.200}") is None:
        raise SourceError(f"{where}: FileName: found {name!r:.200}, expected a TIFF file beside it")
    return Location(path, True)


def _is_ome(description: str) -> bool:
    text = description.strip("\ufeff\0 \t\r\n")
    head = text[:_HEAD]
    is_named = text.endswith("OME>") or "<OME" in head or "openmicroscopy.org" in head
    return text.startswith("<") and is_named


def _with_note(location: Location, image: Image) -> Image:
    if not location.parts[-1].lower().endswith(_OME_NAMES):
        return image
    note = "the name says OME-TIFF, but there is no OME-XML in it: read as plain TIFF"
    return replace(image, notes=(note, *image.notes))


def _otherwise(tiff: TiffFile) -> str:
    """Return the words for what a file is whose OME-XML can't be read."""
    try:
        with one_line("", "pages"):
            found = kind_of(tiff.series[0])
    except SourceError:
        return ""
    return (
        f" (without it the file is {found}: saved anew as TIFF by ImageJ, say, it is read "
        "without OME-XML)"
    )


def _companion(location: Location, name: str) -> str:
    """Return the OME-XML of a set whose files refer to one beside them. Raises SourceError."""
    named = f"{location.shown}: OME-XML: BinaryOnly MetadataFile {name!r:.100}"
    if not location.is_local:
        raise SourceError(f"{named}: beside an address, expected the set on this machine")
    path = os.path.join(location.folder, name)
    status = require_own(path, [location.folder], named=named)
    if status is None:
        raise SourceError(f"{named}: not found, expected it beside the TIFF file")
    return _text_of(path, named)


def _text_of(path: str, named: str) -> str:
    """Return the OME-XML of a file. Raises SourceError."""
    with one_line(named, "OME-XML"):
        size = os.path.getsize(path)
        if size > _MAX_COMPANION:
            raise SourceError(f"{named}: found {size} bytes, expected OME-XML")
        with open(path, encoding="utf-8") as file:
            return file.read().strip()
