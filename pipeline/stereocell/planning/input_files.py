"""The files of a build's inputs, as they were when this process first opened them.

A plan records sizes and dates before it reads a voxel. Each pass over the tiles compares them at
its end.
"""

from dataclasses import replace

from stereocell.model.errors import SourceError
from stereocell.planning.settings import PlanOptions
from stereocell.read import Dataset
from stereocell.steps.open_source import SourceRef, open_source
from stereocell.storage.file_states import FileStates
from stereocell.storage.location import Location

_first: dict[SourceRef, FileStates] = {}  # by reference, without the fingerprint
_tables: dict[str, FileStates] = {}  # by the path in the settings


def as_asked(source: str, options: PlanOptions, *, fingerprint: str = "") -> SourceRef:
    """Return the reference to a source that is read as the settings say."""
    return SourceRef(
        source,
        options.time,
        options.spacing_um,
        options.series,
        fingerprint,
        options.pattern,
        options.axes,
        options.dark,
    )


def open_anew(ref: SourceRef) -> Dataset:
    """Return the dataset for a new plan: opened again where its files changed since then."""
    known = _first.pop(_key(ref), None)
    if known is not None and known.changed():
        open_source.cache_clear()
    return open_watched(ref)


def open_watched(ref: SourceRef) -> Dataset:
    """Return the dataset; record the state of its files if this process has not done so yet."""
    dataset = open_source(ref)
    if _key(ref) not in _first:
        _first[_key(ref)] = FileStates.look(Location.of(ref.source), dataset.files)
    return dataset


def open_states(ref: SourceRef) -> FileStates:
    """Return the files as this process first saw them; the first call is made now if need be."""
    open_watched(ref)
    return _first[_key(ref)]


def first_states(ref: SourceRef) -> FileStates | None:
    """Return the files as this process first saw them; None: it has not opened them yet."""
    return _first.get(_key(ref))


def watch_table(path: str) -> None:
    """Record the state of a table's file before a plan reads it."""
    location = Location.of(path)
    whole = location.path if location.is_local else location.source
    _tables[path] = FileStates.look(location, [whole])


def require_table(path: str) -> None:
    """Raise SourceError where a table changed since this process planned with it."""
    states = _tables.get(path)
    if states is not None and states.changed():
        forget()
        raise SourceError(
            f"{states.location.shown}: changed since it was planned, expected a table that does "
            "not change during a build: run the same command again, which goes on from here"
        )


def forget() -> None:
    """Forget all inputs, so that they are opened again: one of them changed."""
    _first.clear()
    _tables.clear()
    open_source.cache_clear()


def _key(ref: SourceRef) -> SourceRef:
    return replace(ref, fingerprint="")
