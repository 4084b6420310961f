"""Tell a source, which is shown and built, from a build and a bundle, which are only shown."""

from pathlib import Path

from stereocell.read.addresses.resolve import may_know
from stereocell.read.known_formats import find_format
from stereocell.storage.contents import contents_of
from stereocell.storage.kinds import Kind
from stereocell.storage.location import Location


def is_source(place: Path | str) -> bool:
    """Return whether a place is a source, and neither a build nor a bundle.

    A path that does not exist counts as a source if its name has the ending of a known format. The
    reader then reports that it is missing.
    """
    if isinstance(place, Path) and place.exists():
        return contents_of(place).kind in (Kind.FILE, Kind.FOLDER)
    if may_know(place):
        return True
    return find_format(Location.of(place)) is not None
