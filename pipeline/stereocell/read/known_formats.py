"""The formats that are read, and the search for a source's format.

Each module of `read/formats` is one format. A new module is found by itself: there is no list.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from stereocell.read.format import Format
from stereocell.storage import first_bytes
from stereocell.storage.first_bytes import Content, Marks
from stereocell.storage.location import Location
from stereocell.storage.location import first_bytes as head_of

OTHER = "other"  # name of the format that takes files which no other format recognises
_PACKAGE = "stereocell.read.formats"


@cache
def known_formats() -> Mapping[str, Format]:
    """Return all formats by their names."""
    found = {}
    for one in sorted(iter_modules(import_module(_PACKAGE).__path__), key=lambda one: one.name):
        module = f"{_PACKAGE}.{one.name}"
        name = one.name.replace("_", "-")
        row: Format = import_module(module).FORMAT
        found[name] = replace(row, name=name, module=module)
    return found


def format_of(source: str | Path) -> Format:
    """Return the format of a source by its name and content, or the format of other files."""
    return find_format(Location.of(source)) or known_formats()[OTHER]


def find_format(location: Location) -> Format | None:
    """Return the format of a source by its name and content; None: no format recognises it.

    The order is: a folder's name, a look into the source, the ending of a file's name, its first
    bytes, an ambiguous ending. Last comes a format that takes any remaining source, as DICOM
    takes folders. At an address only names and the address itself count.
    """
    formats = [one for one in known_formats().values() if one.name != OTHER]
    for part in reversed(location.parts):
        for one in formats:
            if part.endswith(one.folder_endings):
                return one
    last = location.parts[-1].lower() if location.parts else ""
    named = (one for one in formats if last.endswith(one.endings))
    if not location.is_local:
        shown = location.shown
        at = (one for one in formats if one.addresses is not None and one.addresses.search(shown))
        return next(named, None) or next(at, None)
    looking = (one for one in formats if one.holds is not None and one.holds(location))
    named = (one for one in named if one.holds is None)
    loosely = (one for one in formats if last.endswith(one.loose_endings))
    lasting = (one for one in formats if one.may_hold is not None and one.may_hold(location))
    return (
        next(looking, None)
        or next(named, None)
        or _by_marks(location)
        or next(loosely, None)
        or next(lasting, None)
    )


def _by_marks(location: Location) -> Format | None:
    found = known_formats().get(identify(head_of(location.path)).format)
    return None if found is None or found.needs_ending else found


def is_unknown(_path: str, head: bytes) -> bool:
    """Return whether a file begins like no known format or container."""
    return not identify(head).is_known


def identify(head: bytes) -> Content:
    """Return what a file that begins with these bytes holds: a format, or just a description."""
    return first_bytes.identify(head, _marks())


@cache
def _marks() -> Marks:
    """Return all marks: those at the first byte first, then those farther inside.

    The bytes before an inner mark are free text in some formats and may hold another format's mark.
    """
    marks = [(one.name, mark) for one in known_formats().values() for mark in one.marks]
    return sorted(marks, key=lambda pair: (pair[1].at > 0, -pair[1].at))
