"""Read TIFF: OME-TIFF, and files of ImageJ, Zeiss LSM, MetaMorph, Micro-Manager, tifffile, others.

ome.py reads files with OME-XML, plain.py all others; both use tifffile.
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
from stereocell.read.formats.tiff.companion import (
    Described,
    companion_at,
    companion_of,
    first_of_set,
    is_companion,
)
from stereocell.read.formats.tiff.ome import read_ome
from stereocell.read.formats.tiff.ome_images import choose_image, list_images
from stereocell.read.formats.tiff.ome_set import settle_files
from stereocell.read.formats.tiff.open_file import open_tiff, refuse_short
from stereocell.read.formats.tiff.plain import kind_of, read_plain
from stereocell.read.image import Image
from stereocell.read.modulo import listed, split
from stereocell.read.series import lines
from stereocell.storage.library_errors import collected_log, one_line
from stereocell.storage.location import Location

logging.getLogger("tifffile").addHandler(logging.NullHandler())  # errors also raise exceptions
_OME_NAMES = (".ome.tif", ".ome.tiff", ".ome.tf2", ".ome.tf8", ".ome.btf")
_BEYOND = re.compile(r"invalid page offset ([0-9]+)")  # tifffile's message


def read_image(location: Location, axes: str = "", series: int = 0) -> Image:
    """Return one image of the file.

    axes    letters of the axes longer than 1, slowest first, such as `zcyx`; empty: the file's own
    series  number among the images of OME-XML (ome_images.py, modulo.py); 0: the largest

    Raises SourceError where the file can't be read as an image, UsageError where it has another
    number of axes or no such image.
    """
    image, root, part = _read(location, axes, series)
    try:
        return split(location.shown, image, root, part)
    except BaseException:
        if image.close is not None:
            image.close()
        raise


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each image, and for each part along further axes. Raises SourceError."""
    with ExitStack() as stack, collected_log("tifffile"):
        described = _open(location, stack)[2]
        if described is not None and ome_xml.count_images(described.root) > 1:
            with one_line(location.shown, "an OME-XML with whole numbers as sizes"):
                return lines(list_images(location, described.root))
    image, root, _ = _read(location, "", 0)
    if image.close is not None:
        image.close()
    return lines(listed(image, root))


def _open(location: Location, stack: ExitStack) -> tuple[Location, TiffFile, Described | None]:
    """Return the opened file of a source with its OME-XML; None: it has none."""
    given = location.source if is_companion(location) else ""
    if given:
        location = first_of_set(location)
    tiff = open_tiff(location, stack)
    with one_line(location.shown, "a complete TIFF file"):
        text = tiff.pages.first.description
    if not given and not ome_xml.is_ome(text):
        return location, tiff, None
    return location, tiff, _described(location, tiff, text, given)


def _read(
    location: Location, axes: str, series: int
) -> tuple[Image, ElementTree.Element | None, int]:
    """Return the image as stored, its OME-XML (None: it has none), and the series of its parts."""
    stack = ExitStack()
    try:
        with collected_log("tifffile") as log:
            location, tiff, described = _open(location, stack)
            if described is None:
                image = read_plain(location, tiff, stack, axes)
                _require_pages_read(location, tiff, log)
                return _with_note(location, image), None, series
            chosen = choose_image(location, described.root, series)
            text, beside = described.text, described.path
            is_changed, notes = settle_files(location, chosen.root, is_companion=bool(beside))
            is_changed = is_changed or chosen.root is not described.root
            if is_changed:
                text = ElementTree.tostring(chosen.root, encoding="unicode")
            if beside or is_changed:
                tiff = open_tiff(location, stack, omexml=text)
            image = read_ome(location, tiff, stack, chosen=chosen, text=text, log=log, axes=axes)
            files = (*image.files, *([beside] if beside else []))
            image = replace(image, files=files, notes=(*chosen.notes, *notes, *image.notes))
            return image, chosen.root, chosen.series
    except BaseException:
        stack.close()
        raise


def _described(location: Location, tiff: TiffFile, text: str, given: str) -> Described:
    """Return the OME-XML of a file or of its set. Raises SourceError.

    text   description of the file's first page
    given  path of the companion that the user named; empty: the user named a TIFF file
    """
    if given:
        return companion_at(given, given)
    try:
        root = ome_xml.parse(text, location.shown)
    except SourceError as error:
        raise SourceError(f"{error}{_otherwise(tiff)}") from error
    return companion_of(location, root) or Described(root, text)


def _require_pages_read(location: Location, tiff: TiffFile, log: Sequence[str]) -> None:
    """Raise SourceError where tifffile left out pages beyond the end of a file at an address."""
    for message in log:
        found = _BEYOND.search(message)
        if found:
            refuse_short(location.shown, tiff.filehandle.size, int(found[1]))


def _with_note(location: Location, image: Image) -> Image:
    if not location.parts[-1].lower().endswith(_OME_NAMES):
        return image
    note = "the name says OME-TIFF, but the file has no OME-XML: read as plain TIFF"
    return replace(image, notes=(note, *image.notes))


def _otherwise(tiff: TiffFile) -> str:
    """Return the remedy for a file whose OME-XML can't be read, with a description of its pages."""
    try:
        with one_line("", "pages"):
            found = kind_of(tiff.series[0])
    except SourceError:
        return ""
    return (
        f" (without it the file is {found}: save it again as TIFF, for example with ImageJ, to "
        "read it without OME-XML)"
    )
