"""Find the data behind an address that a person has copied from a browser.

`resolve` is called where a person enters an address, before `read.open`. A plan stores its result,
so no worker asks a service again, and no file written by a stranger triggers requests.
"""

from collections.abc import Callable
from pathlib import Path
from threading import Lock

from stereocell.read.addresses import bioimage_archive, dandi, dicomweb, idc, idr, omero
from stereocell.read.addresses.resolved import Resolved
from stereocell.read.known_formats import find_format
from stereocell.storage.location import Location

# In the order of the search: fixed hosts first, then forms that any host may have.
RESOLVERS: tuple[Callable[[str], Resolved | None], ...] = (
    idc.resolve,
    idr.resolve,
    dandi.resolve,
    bioimage_archive.resolve,
    dicomweb.resolve,
    omero.resolve,
)
_known: dict[str, Resolved] = {}  # addresses that this process has resolved
_lock = Lock()


def resolve(source: str | Path) -> Resolved:
    """Return the data behind a source: the source itself, or the data at a known service.

    Raises StereoCellError where the service doesn't have the data, or the address has an unknown
    form. Fetched files lie in a folder until this process ends.
    """
    location = Location.of(source)
    if location.is_local or not may_know(location.source) or find_format(location) is not None:
        return Resolved(location.source)
    with _lock:
        if location.source not in _known:
            answers = (ask(location.source) for ask in RESOLVERS)
            found = next((one for one in answers if one is not None), None)
            if found is None:
                return Resolved(location.source)
            _known[location.source] = found
        return _known[location.source]


def remember(source: str | Path, found: Resolved) -> None:
    """Store a result of `resolve` that another process of the same command has found."""
    _known[Location.of(source).source] = found


def may_know(source: str | Path) -> bool:
    """Return whether a source is an address that a service may know."""
    return str(source).startswith(("http://", "https://", "s3://idc-open-data"))
