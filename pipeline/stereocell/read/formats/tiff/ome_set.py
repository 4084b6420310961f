"""Compare the files of an OME-TIFF set with the UUIDs in its OME-XML.

The OME-XML names the file of each plane twice, by its name and by its UUID. The library tifffile
opens files by their names and never compares the UUIDs. A file of another acquisition with the
right name would therefore be read as part of this one. Each file states its own UUID in its own
OME-XML. A renamed file is found by its UUID. A file that states no UUID is accepted by its name.

References: https://docs.openmicroscopy.org/ome-model/latest/ome-tiff/specification.html
"""

import filecmp
import os
import re
from contextlib import ExitStack, suppress
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

from stereocell.model.errors import SourceError
from stereocell.read import ome_xml
from stereocell.read.formats.tiff.open_file import SUFFIXES, open_tiff
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location, require_own

_MOST_SEARCHED = 1000  # files of a folder that are opened to find one by its UUID
_HEAD = 16_384  # characters of a description that contain the first tag of OME-XML
_OF_ANOTHER = "{!r:.100} states the UUID of another file of its set: it is accepted by its name"
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_OWN_UUID = re.compile(r"""<(?:[\w.-]+:)?OME\b[^<>]*?\sUUID\s*=\s*["']([^"']*)""")


def settle_files(
    location: Location, root: ElementTree.Element, *, is_companion: bool
) -> tuple[bool, tuple[str, ...]]:
    """Correct the file names in the OME-XML of a set with the UUIDs that the files state.

    root          root of the OME-XML, changed in place
    is_companion  whether the OME-XML is in a separate file

    Returns whether the OME-XML was changed, and a note for each file with another name.

    Only files of the first image are compared, since only that image is read. Raises SourceError
    for a file outside the source's folder, and for one with the UUID of another file. A missing
    file is not refused here: the missing planes are counted later. At an address, tifffile opens no
    other file.
    """
    if not location.is_local:
        return False, ()
    names = (uuid.get("FileName") for uuid in ome_xml.uuids_of(root) if _is_other(uuid, root))
    # names in all images are checked, because tifffile opens all these files
    for name in dict.fromkeys(names):
        if name is not None:
            _require_inside(location, name)
    return _Set(location, root, is_companion=is_companion).settle()


def _is_other(uuid: ElementTree.Element, root: ElementTree.Element) -> bool:
    """Return whether a UUID belongs to another file than the one with the OME-XML."""
    return uuid.text != root.get("UUID", "")


def _require_inside(location: Location, name: str) -> bool:
    """Return whether a named file exists. Raises SourceError outside the source's folder."""
    named = f"{location.shown}: OME-XML: UUID FileName {name!r:.200}"
    path = os.path.join(os.path.dirname(os.path.realpath(location.path)), name)
    return require_own(path, [location.folder], named=named) is not None


class _Set:
    """The files that the first image of an OME-XML names."""

    def __init__(
        self, location: Location, root: ElementTree.Element, *, is_companion: bool
    ) -> None:
        self._location, self._root, self._is_companion = location, root, is_companion
        self._own = os.path.realpath(location.path)
        self._folder = Path(self._own).parent
        self._root_uuid = _plain(root.get("UUID"))
        self._elements = [e for _, e in ome_xml.tiff_data_of(root) if e is not None]

    def settle(self) -> tuple[bool, tuple[str, ...]]:
        """Correct the OME-XML; return whether it was changed, and the notes."""
        is_changed = self._name_empty()
        by_uuid = self._by_uuid()
        notes = self._settle_own(by_uuid)
        for uuid, elements in by_uuid.items():
            name = elements[0].get("FileName", "")
            found, note = self._settled(uuid, name)
            if note:
                notes.append(note)
                for element in elements:
                    element.set("FileName", found)
        return is_changed or bool(notes), tuple(notes)

    def _name_empty(self) -> bool:
        """Replace empty UUIDs, which tifffile takes for the opened file. Return whether any was."""
        empty = [element for element in self._elements if not _plain(element.text)]
        for element in empty:
            element.text = element.get("FileName", "")
        return bool(empty)

    def _by_uuid(self) -> dict[str, list[ElementTree.Element]]:
        """Return the elements by UUID. Raises SourceError where two files have the same UUID."""
        found: dict[str, list[ElementTree.Element]] = {}
        for element in self._elements:
            name = element.get("FileName", "")
            others = found.setdefault(_plain(element.text), [])
            others.append(element)
            if name != others[0].get("FileName", ""):
                raise SourceError(
                    f"{self._location.shown}: OME-XML: UUID {element.text!r:.60}: found the files "
                    f"{others[0].get('FileName', '')!r:.100} and {name!r:.100}, expected one file"
                )
        return found

    def _settle_own(self, by_uuid: dict[str, list[ElementTree.Element]]) -> list[str]:
        """Identify the opened file by its name if all files of the set state the same UUID.

        Returns a note in that case.
        """
        named = {elements[0].get("FileName", ""): elements for elements in by_uuid.values()}
        by_name = named.get(os.path.basename(self._own))
        first = by_uuid.get(self._root_uuid)
        if self._is_companion or first is None or by_name in (None, first):
            return []
        path = self._folder / first[0].get("FileName", "")
        if not path.is_file() or _stated_uuid(str(path)) != self._root_uuid:
            return []
        if filecmp.cmp(path, self._own, shallow=False):
            return []
        self._root.set("UUID", by_name[0].text or "")
        self._root_uuid = _plain(by_name[0].text)
        return [_OF_ANOTHER.format(os.path.basename(self._own))]

    def _settled(self, uuid: str, name: str) -> tuple[str, str]:
        """Return the name of the file with a UUID, and a note if it differs from `name`."""
        if not self._is_companion and uuid == self._root_uuid:
            return name, ""  # the UUID is that of the opened file, whatever its name is
        path = self._folder / name
        is_there = bool(name) and _require_inside(self._location, name)
        is_own = is_there and os.path.samefile(path, self._own)
        if is_own and not self._is_companion and self._root_uuid not in self._uuids:
            return name, ""  # the OME-XML inside a file describes that file
        stated = _stated_uuid(str(path)) if is_there else ""
        if is_there and stated in ("", uuid):
            return name, ""
        if other := self._by_stated_uuid.get(uuid):
            return other, f"{other!r:.90} has the UUID of {name!r:.90}: read in its place"
        is_of_set = stated == self._root_uuid  # a writer gave each file the same OME-XML
        if is_there and is_of_set and not filecmp.cmp(path, self._own, shallow=False):
            return name, _OF_ANOTHER.format(name)
        if is_there:
            raise SourceError(
                f"{self._location.shown}: OME-XML: UUID FileName {name!r:.100}: found a file with "
                f"UUID {stated!r:.60} of another set, expected {uuid!r:.60}: "
                "copy the files of this set into a folder of their own"
            )
        if not self._root_uuid and not self._is_companion and len(self._names) == 1:
            own = os.path.basename(self._own)
            return own, f"the OME-XML names this file {name!r:.100}"
        return name, ""

    @cached_property
    def _uuids(self) -> set[str]:
        return {_plain(element.text) for element in self._elements}

    @cached_property
    def _names(self) -> set[str]:
        return {element.get("FileName", "") for element in self._elements}

    @cached_property
    def _by_stated_uuid(self) -> dict[str, str]:
        """The names of the folder's other files, by the UUIDs that they state."""
        found: dict[str, str] = {}
        names = (path.name for path in self._folder.iterdir() if not path.is_symlink())
        names = (name for name in names if name.lower().endswith(SUFFIXES))
        for name in sorted(names)[:_MOST_SEARCHED]:
            uuid = _stated_uuid(str(self._folder / name))
            if uuid:
                found.setdefault(uuid, name)
        return found


def _plain(uuid: str | None) -> str:
    """Return a UUID in the form in which UUIDs are compared."""
    return (uuid or "").strip().lower().removeprefix("urn:uuid:")


def _stated_uuid(path: str) -> str:
    """Return the UUID in a file's own OME-XML; empty: it states none, or can't be read."""
    with suppress(SourceError), ExitStack() as stack, one_line(path, "a complete TIFF file"):
        tiff = open_tiff(Location(path, True), stack)
        head = _COMMENT.sub("", tiff.pages.first.description[:_HEAD])
        found = _OWN_UUID.search(head)
        return _plain(found[1]) if found else ""
    return ""
