"""Read the OME-XML of a set of TIFF files from a separate file, a companion.

Each TIFF file of such a set names the companion, and states its own UUID and the companion's.

References: https://docs.openmicroscopy.org/ome-model/latest/ome-tiff/specification.html
"""

import os
from dataclasses import dataclass
from xml.etree import ElementTree

from stereocell.model.errors import SourceError
from stereocell.read import ome_xml
from stereocell.read.file_kind import refused
from stereocell.read.formats.tiff.open_file import SUFFIXES
from stereocell.read.known_formats import identify
from stereocell.storage.first_bytes import XML
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location, first_bytes, require_own

_SUFFIX = ".companion.ome"
_MAX_BYTES = 64 << 20  # bytes of an OME-XML beside the TIFF files


@dataclass(frozen=True, slots=True)
class Described:
    """The OME-XML of a file or a set.

    path  path of the companion; empty: the OME-XML is in the TIFF file itself
    """

    root: ElementTree.Element
    text: str
    path: str = ""


def is_companion(location: Location) -> bool:
    """Return whether a source is named like a companion."""
    return location.parts[-1].lower().endswith(_SUFFIX)


def first_of_set(location: Location) -> Location:
    """Return the first TIFF file of a set from its companion. Raises SourceError."""
    where = location.shown
    if not location.is_local:
        raise SourceError(f"{where}: found OME-XML at an address, expected the set on this machine")
    content = identify(first_bytes(location.source))
    if content.words != XML:
        raise refused(location, content, "OME-XML")
    name = next(ome_xml.files_of(companion_at(location.source, where).root), "")
    path = os.path.join(location.folder, name)
    if not name or require_own(path, [location.folder], named=f"{where}: {name!r:.200}") is None:
        raise SourceError(f"{where}: FileName: found {name!r:.200}, expected a TIFF file beside it")
    return Location(path, True)


def companion_at(path: str, named: str) -> Described:
    """Return the OME-XML of a companion. Raises SourceError."""
    with one_line(named, "OME-XML"):
        size = os.path.getsize(path)
        if size > _MAX_BYTES:
            raise SourceError(f"{named}: found {size} bytes, expected at most {_MAX_BYTES}")
        with open(path, encoding="utf-8") as file:
            text = file.read().strip()
    return Described(ome_xml.parse(text, named), text, path)


def companion_of(location: Location, root: ElementTree.Element) -> Described | None:
    """Return the companion that a TIFF file's OME-XML names; None: it names none.

    Raises SourceError where the companion is missing or describes another set.
    """
    name, uuid = ome_xml.metadata_file_of(root)
    if not name:
        return None
    named = f"{location.shown}: OME-XML: BinaryOnly MetadataFile {name!r:.100}"
    if not location.is_local:
        raise SourceError(f"{named}: found an address, expected the set on this machine")
    path = os.path.join(location.folder, name)
    if require_own(path, [location.folder], named=named) is None:
        raise SourceError(f"{named}: not found, expected it beside the TIFF file")
    if name.lower().endswith(SUFFIXES):
        raise SourceError(
            f"{named}: found a TIFF file as the companion, expected this set to be opened by that "
            "file"
        )
    found = companion_at(path, named)
    stated = found.root.get("UUID", "")
    uuids = {element.text for element in ome_xml.uuids_of(found.root)}
    if uuid and stated and uuid != stated and root.get("UUID") not in uuids:
        raise SourceError(
            f"{named}: found UUID {stated!r:.60}, expected {uuid!r:.60}: it describes another set"
        )
    return found
