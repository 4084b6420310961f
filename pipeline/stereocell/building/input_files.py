"""The files of a build's inputs, as they were when this process first opened them.

A plan looks at them before it reads a voxel; each pass over the tiles compares them at its end.
"""

from dataclasses import replace

from stereocell.building.open_source import SourceRef, open_source
from stereocell.model.errors import SourceError
from stereocell.read import Dataset
from stereocell.storage.file_states import FileStates
from stereocell.storage.location import Location

_first: dict[SourceRef, FileStates] = {}
_tables: dict[str, FileStates] = {}  # by the path that the settings have


def open_anew(ref: SourceRef) -> Dataset:
    """Return the dataset for a new plan: opened again where its files changed meanwhile."""
    known = _first.pop(_key(ref), None)
    if known is not None and known.changed():
        open_source.cache_clear()
    return open_watched(ref)


def open_watched(ref: SourceRef) -> Dataset:
    """Return the dataset; its files are looked at where this process hasn't done so yet."""
    dataset = open_source(ref)
    if _key(ref) not in _first:
        _first[_key(ref)] = FileStates.look(Location.of(ref.source), dataset.files)
    return dataset


def open_states(ref: SourceRef) -> FileStates:
    """Return the files as this process first saw them, which may be now."""
    open_watched(ref)
    return _first[_key(ref)]


def first_states(ref: SourceRef) -> FileStates | None:
    """Return the files as this process first saw them; None: it has not opened them."""
    return _first.get(_key(ref))


def watch_table(path: str) -> None:
    """Look at a table as a plan reads it."""
    location = Location.of(path)
    whole = location.path if location.is_local else location.source
    _tables[path] = FileStates.look(location, [whole])


def require_table(path: str) -> None:
    """Raise SourceError where a table changed since this process planned with it."""
    states = _tables.get(path)
    if states is not None and states.changed():
        forget()
        raise SourceError(
            f"{states.location.shown}: changed since it was planned, expected a table that stays "
            "as it is while it is built: run the same command again, which goes on from here"
        )


def forget() -> None:
    """Open and look at all inputs again: one of them changed."""
    _first.clear()
    _tables.clear()
    open_source.cache_clear()


def _key(ref: SourceRef) -> SourceRef:
    return replace(ref, fingerprint="")
