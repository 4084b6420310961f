"""TIFF: OME-TIFF, and what ImageJ, Zeiss LSM, MetaMorph, Micro-Manager, tifffile and others write.

read/tiff/ome.py reads files with OME-XML, read/tiff/plain.py all others; both use tifffile.
"""

import logging
import re
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from xml.etree import ElementTree

from tifffile import TiffFile

from stereocell.model.errors import SourceError
from stereocell.read import ome_xml
from stereocell.read.image import Image
from stereocell.read.modulo import listed, split
from stereocell.read.series import lines
from stereocell.read.tiff.companion import (
    Described,
    companion_at,
    companion_of,
    first_of_set,
    is_companion,
)
from stereocell.read.tiff.ome import read_ome
from stereocell.read.tiff.ome_set import settle_files
from stereocell.read.tiff.open_file import open_tiff, refuse_short
from stereocell.read.tiff.plain import kind_of, read_plain
from stereocell.storage.library_errors import collected_log, one_line
from stereocell.storage.location import Location

logging.getLogger("tifffile").addHandler(logging.NullHandler())  # errors are raised here
_OME_NAMES = (".ome.tif", ".ome.tiff", ".ome.tf2", ".ome.tf8", ".ome.btf")
_BEYOND = re.compile(r"invalid page offset ([0-9]+)")  # tifffile's words


def read_image(location: Location, axes: str = "", series: int = 0) -> Image:
    """Return the first image of the file.

    axes    of those longer than 1, slowest first, as `zcyx`; empty: the file's own
    series  of the images that lie along a further axis of OME-XML (modulo.py); 0: the first

    Raises SourceError where the file can't be read as an image, UsageError where it has another
    number of axes or no such image.
    """
    image, root = _read(location, axes)
    try:
        return split(location.shown, image, root, series)
    except BaseException:
        if image.close is not None:
            image.close()
        raise


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each image along a further axis. Raises SourceError."""
    image, root = _read(location, "")
    if image.close is not None:
        image.close()
    return lines(listed(image, root))


def _read(location: Location, axes: str) -> tuple[Image, ElementTree.Element | None]:
    """Return the image as it is stored, and the root of its OME-XML; None: it has none."""
    given = location.source if is_companion(location) else ""
    if given:
        location = first_of_set(location)
    where = location.shown
    stack = ExitStack()
    try:
        with collected_log("tifffile") as log:
            tiff = open_tiff(location, stack)
            with one_line(where, "a TIFF file, whole"):
                text = tiff.pages.first.description
            if not given and not ome_xml.is_ome(text):
                image = read_plain(location, tiff, stack, axes)
                _require_pages_read(location, tiff, log)
                return _with_note(location, image), None
            described = _described(location, tiff, text, given)
            root, text, beside = described.root, described.text, described.path
            is_changed, notes = settle_files(location, root, is_companion=bool(beside))
            if is_changed:
                text = ElementTree.tostring(root, encoding="unicode")
            if beside or is_changed:
                tiff = open_tiff(location, stack, omexml=text)
            image = read_ome(location, tiff, stack, root=root, text=text, log=log, axes=axes)
            files = (*image.files, *([beside] if beside else []))
            return replace(image, files=files, notes=(*notes, *image.notes)), root
    except BaseException:
        stack.close()
        raise


def _described(location: Location, tiff: TiffFile, text: str, given: str) -> Described:
    """Return the OME-XML of a file or of its set. Raises SourceError.

    text   of the file's first page
    given  path of the file of OME-XML that the user named; empty: none
    """
    if given:
        return companion_at(given, given)
    try:
        root = ome_xml.parse(text, location.shown)
    except SourceError as error:
        raise SourceError(f"{error}{_otherwise(tiff)}") from error
    return companion_of(location, root) or Described(root, text)


def _require_pages_read(location: Location, tiff: TiffFile, log: Sequence[str]) -> None:
    """Raise SourceError where tifffile left out pages behind the end of a file at an address."""
    for message in log:
        found = _BEYOND.search(message)
        if found:
            refuse_short(location.shown, tiff.filehandle.size, int(found[1]))


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
