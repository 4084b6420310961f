"""Record the states of an input's files, and find the files that changed since then.

The state of a file is its size and modification time, that of an object its size and ETag. The
bytes of small inputs are compared, too, so a file that was written again with the same bytes counts
as unchanged. An `http` address can't be listed. Its states are complete only if the source is one
file and the server states an ETag or a date.
"""

import hashlib
import os
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import fsspec

from stereocell.model.errors import SourceError
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

MAX_READ_BYTES = 64_000_000  # bytes; in total at most this much is compared by content
MAX_READ_FILES = 2_000  # most files that are compared by content
_UNLISTED = ("http", "https")
# Fields of fsspec's file systems whose value changes with an object's content
_MARKS = (
    "ETag",
    "etag",
    "Content-MD5",
    "md5Hash",
    "LastModified",
    "Last-Modified",
    "mtime",
    "created",
)

State = tuple[int, str]  # size in bytes; modification time or ETag


@dataclass(frozen=True, slots=True)
class FileStates:
    """The states of files at one time.

    paths        files, and folders with all files below them; addresses of a remote source
    states       states by path; a missing file has none
    digests      SHA-256 by path; empty if the files are too many or too large
    is_complete  whether all files could be listed
    """

    location: Location
    paths: tuple[str, ...]
    states: Mapping[str, State] = field(repr=False)
    digests: Mapping[str, str] = field(repr=False)
    is_complete: bool

    @classmethod
    def look(cls, location: Location, paths: Sequence[str]) -> "FileStates":
        """Return the present states. There are none if the store does not allow listing."""
        try:
            states = dict(_listed(location, paths))
        except SourceError:
            return cls(location, tuple(paths), {}, {}, False)
        is_complete = location.is_local or not location.source.startswith(_UNLISTED)
        if not is_complete and tuple(paths) == (location.source,):
            is_complete = all(mark for _, mark in states.values()) and bool(states)
        is_small = sum(size for size, _ in states.values()) <= MAX_READ_BYTES
        digests = {}
        if location.is_local and is_small and len(states) <= MAX_READ_FILES:
            digests = {path: _digest(path) for path in states}
        return cls(location, tuple(paths), states, digests, is_complete)

    def names(self) -> set[str]:
        """Return the paths of all files, relative to the source, with `/`."""
        source = self.location.source
        root = source.partition("://")[2] if not self.location.is_local else source
        root = f"{os.path.normpath(root)}/".replace(os.sep, "/").lstrip("/")
        paths = (os.path.normpath(path).replace(os.sep, "/").lstrip("/") for path in self.states)
        return {path.removeprefix(root) for path in paths}

    def lines(self) -> list[str]:
        """Return a line for each file: its path below the source, and its digest or state."""
        source = self.location.path if self.location.is_local else self.location.source
        known = {path: self.digests.get(path) or f"{state}" for path, state in self.states.items()}
        return sorted(f"{path.removeprefix(source)} {about}\n" for path, about in known.items())

    def changed(self) -> list[str]:
        """Return the paths of changed, missing and new files. Raises SourceError."""
        if not self.is_complete and not self.states:
            return []
        now = dict(_listed(self.location, self.paths))
        differ = [path for path in {**self.states, **now} if self.states.get(path) != now.get(path)]
        return sorted(path for path in differ if not self._is_rewritten(path))

    def _is_rewritten(self, path: str) -> bool:
        """Return whether a file has a new state, but the bytes that it had before."""
        known = self.digests.get(path)
        return known is not None and known == _digest(path)


def _digest(path: str) -> str:
    """Return the SHA-256 of a file's bytes; empty: it can't be read."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


def _listed(location: Location, paths: Sequence[str]) -> Iterator[tuple[str, State]]:
    if location.is_local:
        for path in paths:
            yield from _on_disk(path)
        return
    with one_line(location.shown, "an address that fsspec opens"):
        files, _ = fsspec.url_to_fs(location.source, **location.storage_options)
        files.invalidate_cache()
        for path in paths:
            for name, about in _stored(files, path, location):
                mark = next((str(about[key]) for key in _MARKS if about.get(key)), "")
                yield name, (int(about.get("size") or 0), mark)


def _on_disk(path: str, *, is_inner: bool = False) -> Iterator[tuple[str, State]]:
    """Yield a file, or the files below a folder. Files that vanish in the meantime are left out.

    is_inner  whether the path lies in a listed folder, where links to folders are not followed
    """
    try:
        found = os.stat(path)
        if stat.S_ISREG(found.st_mode):
            yield path, (found.st_size, str(found.st_mtime_ns))
            return
        if not stat.S_ISDIR(found.st_mode) or (is_inner and os.path.islink(path)):
            return
        names = sorted(os.listdir(path))
    except OSError:
        return
    for name in names:
        yield from _on_disk(os.path.join(path, name), is_inner=True)


def _stored(
    files: Any, address: str, location: Location
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield each object at or below an address, with the details that the store states."""
    path = files._strip_protocol(address)
    if location.source.startswith(_UNLISTED):
        try:
            yield path, files.info(path)
        except FileNotFoundError:
            return
        return
    yield from files.find(path, detail=True).items()


@contextmanager
def unchanged_while_read(location: Location, again: str) -> Iterator[None]:
    """Raise SourceError if a file or a folder changed while the block read all of it.

    again  what the user should do, for the message
    """
    before = FileStates.look(location, [location.path if location.is_local else location.source])
    yield
    if before.changed():
        raise SourceError(
            f"{location.shown}: changed while it was read, expected a file that does not change: "
            f"{again}"
        )
