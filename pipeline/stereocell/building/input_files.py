"""The files of a build's inputs, as they were when this process first opened them.

A plan looks at them before it reads a voxel; each pass over the tiles compares them at its end.
"""

from dataclasses import replace

from stereocell.building.open_source import SourceRef, open_source
from stereocell.read import Dataset
from stereocell.storage.file_states import FileStates
from stereocell.storage.location import Location

_first: dict[SourceRef, FileStates] = {}


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


def forget() -> None:
    """Open and look at all inputs again: one of them changed."""
    _first.clear()
    open_source.cache_clear()


def _key(ref: SourceRef) -> SourceRef:
    return replace(ref, fingerprint="")
