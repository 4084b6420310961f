"""A source's name for display and the folder that it occupies, by the endings of formats."""

import os
from pathlib import Path

from stereocell.model.errors import UsageError
from stereocell.read.known_formats import known_formats
from stereocell.storage.location import Location

_OTHERS = (".zip",)  # endings that belong to no format


def name_of(location: Location) -> str:
    """Return a source's name without its ending, for display; `plate.zarr/0` becomes `plate-0`."""
    parts = location.parts
    whole = tuple(
        ending
        for one in known_formats().values()
        if one.folder_endings
        for ending in (*one.folder_endings, *one.endings)
    )
    outermost = (i for i, part in enumerate(parts) if part.endswith(whole))
    first = next(outermost, len(parts) - 1)
    return "-".join(_stem(part) for part in parts[first:]) or "dataset"


def _stem(name: str) -> str:
    formats = known_formats().values()
    own = (ending for one in formats for ending in (*one.endings, *one.folder_endings))
    for ending in sorted((*own, *_OTHERS), key=len, reverse=True):
        if name.lower().endswith(ending) and len(name) > len(ending):
            return name[: -len(ending)]
    return name


def require_apart(source: str | Path, out: Path) -> None:
    """Raise UsageError if OUT is a local source, or lies inside one (or a folder around it)."""
    outermost = _outermost(source)
    if outermost is not None and _is_in(out, outermost):
        raise UsageError(
            f"OUT is {out}, inside the input {outermost}, where it would be written into the "
            "data, expected a folder elsewhere"
        )


def working_folder_outside(source: str | Path) -> Path:
    """Return the working folder, or the folder around the source if it holds the working folder."""
    outermost = _outermost(source)
    if outermost is None or not _is_in(Path(), outermost):
        return Path()
    return Path(os.path.realpath(outermost)).parent


def _outermost(source: str | Path) -> Path | None:
    """Return the outermost folder of a dataset that the source is part of, or the source itself.

    None: the source is at an address.
    """
    location = Location.of(source)
    if not location.is_local:
        return None
    path = Path(location.source)
    whole = tuple(ending for one in known_formats().values() for ending in one.folder_endings)
    return next((p for p in [*reversed(path.parents), path] if p.name.endswith(whole)), path)


def _is_in(place: Path, folder: Path) -> bool:
    # Path.resolve would raise an error of its own for links that form a ring.
    return Path(os.path.realpath(place)).is_relative_to(os.path.realpath(folder))
