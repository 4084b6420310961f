"""Notice when input files change during a build.

A plan records the sizes and dates of its input files before it reads a voxel. Each pass over the
tiles compares them at its end.
"""

from dataclasses import replace

from stereocell.model.errors import SourceError
from stereocell.planning.settings import PlanOptions
from stereocell.read import Dataset
from stereocell.steps.open_source import SourceRef, forget_sources, open_source, opened_as
from stereocell.storage.file_states import FileStates
from stereocell.storage.location import Location

# States of files when this process first opened them: of sources, by their reference without the
# fingerprint, and of tables, by their path in the settings.
_first: dict[SourceRef, FileStates] = {}
_tables: dict[str, FileStates] = {}


def as_asked(source: str, options: PlanOptions, *, fingerprint: str = "") -> SourceRef:
    """Return the reference to a source, with the settings that say how it is read."""
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


def reopen(ref: SourceRef) -> Dataset:
    """Return the dataset for a new plan; it is opened again if its files have changed."""
    known = _first.pop(_key(ref), None)
    if known is not None and known.changed():
        forget_sources()
    return open_watched(ref)


def open_watched(ref: SourceRef) -> Dataset:
    """Return the opened dataset. The first time, record the state of its files, too.

    The plan opens a source before its fingerprint is known. If no file has changed since, the same
    dataset serves the reference with the fingerprint.
    """
    key = _key(ref)
    first = _first.get(key)
    if ref not in opened_as and first and first.location.is_local and not first.changed():
        opened_as[ref] = key
    dataset = open_source(ref)
    if first is None:
        _first[key] = FileStates.look(Location.of(ref.source), dataset.files)
    return dataset


def open_states(ref: SourceRef) -> FileStates:
    """Return the state of the files when this process first opened them, opening them if needed."""
    open_watched(ref)
    return _first[_key(ref)]


def first_states(ref: SourceRef) -> FileStates | None:
    """Return the state of the files when this process first opened them; None: it has not yet."""
    return _first.get(_key(ref))


def watch_table(path: str) -> None:
    """Record the state of a table's file, before the plan reads the table."""
    location = Location.of(path)
    whole = location.path if location.is_local else location.source
    _tables[path] = FileStates.look(location, [whole])


def require_table(path: str) -> None:
    """Raise SourceError if a table has changed since this process planned with it."""
    states = _tables.get(path)
    if states is not None and states.changed():
        forget()
        raise SourceError(
            f"{states.location.shown}: changed since it was planned, expected a table that does "
            "not change during a build: run the same command again, which goes on from here"
        )


def forget() -> None:
    """Forget the state of all inputs, so that they are opened again after one has changed."""
    _first.clear()
    _tables.clear()
    forget_sources()


def _key(ref: SourceRef) -> SourceRef:
    return replace(ref, fingerprint="")
