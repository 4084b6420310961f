"""Count the sources of other formats in a folder that was given as one source, for messages."""

from collections import Counter
from pathlib import Path

from stereocell.read.known_formats import find_format
from stereocell.storage.location import Location

_LOOKED_AT = 1000  # entries of a folder; more are not counted


def others_in(folder: str | Path, *known: str) -> str:
    """Return the number of sources of each other format in a folder, such as `2 HDF5, 1 MRC`.

    known  names of formats that do not count

    File names may be private and are left out. Empty: no such source, or `folder` is a file.
    """
    root = Path(folder)
    paths = sorted(root.iterdir())[:_LOOKED_AT] if root.is_dir() else []
    formats = filter(None, (find_format(Location.of(path)) for path in paths))
    titles = Counter(one.short_title for one in formats if one.name not in known)
    return ", ".join(f"{count} {title}" for title, count in sorted(titles.items()))


def or_one_of(folder: str | Path, *known: str) -> str:
    """Return the end of a refusal that points to the folder's other sources; empty: none."""
    held = others_in(folder, *known)
    return f", or one of the folder's other files, by its own name ({held})" if held else ""
