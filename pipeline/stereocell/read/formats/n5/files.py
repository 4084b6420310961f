"""Read files of an N5 container, on this machine or at an address, and none outside the source."""

import os
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import fsspec

from stereocell.model.errors import SourceError
from stereocell.read.repeats import load_json
from stereocell.storage.first_bytes import pointer_words
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location, require_own, require_own_key

_MAX_BYTES = 64 << 20  # bytes of a file of attributes that are read
_MAX_FOLDERS = 10_000  # folders that a search for datasets visits at most
_NAME = "attributes.json"


class N5Files:
    """Reads files below a source. `where` is the source's name for messages."""

    def __init__(self, location: Location) -> None:
        self.where = location.shown
        self._location = location
        self._folder = location.folder if location.is_local else None
        self._remote: Any = None
        if not location.is_local:
            with one_line(self.where, "an address that fsspec opens"):
                self._remote = fsspec.url_to_fs(location.source, **location.storage_options)
        self.attributes = lru_cache(maxsize=4096)(self._attributes)

    @property
    def source(self) -> str:
        """The path or address of the container."""
        return self._location.source

    def read(self, path: str) -> bytes | None:
        """Return a file's content; None: there is no such file. Raises OSError or SourceError."""
        named = f"{self.where}: {path!r:.200}"
        if self._folder is not None:
            file = f"{self._location.source}/{path}"
            if not os.path.lexists(file):
                return None
            require_own(file, [self._folder], named=named)
            with open(file, "rb") as opened:
                content = opened.read()
            if words := pointer_words(content):
                raise SourceError(f"{named}: found {words}, expected a file of N5")
            return content
        require_own_key(path, named)
        files, root = self._remote
        try:
            content = bytes(files.cat_file(f"{root.rstrip('/')}/{path}"))
        except FileNotFoundError:
            return None
        return content

    def address(self, path: str) -> str:
        """Return the folder of a dataset, or, over `http`, its file of attributes.

        A folder can't be listed over `http`.
        """
        folder = f"{self._location.source.rstrip('/')}/{path}".rstrip("/")
        is_listed = not self._location.source.startswith("http")
        return folder if is_listed else f"{folder}/{_NAME}"

    def _attributes(self, path: str) -> Mapping[str, Any]:
        """Return the attributes of a group or a dataset; empty: there are none."""
        name = f"{path}/{_NAME}".lstrip("/")
        with one_line(f"{self.where}: {name}", "attributes of N5"):
            return _parsed(self.read(name))

    def above(self) -> Mapping[str, Any]:
        """Return the attributes of the group around a dataset on this machine."""
        if self._folder is None:
            return {}
        file = os.path.join(os.path.dirname(self._location.source), _NAME)
        if not os.path.lexists(file):
            return {}
        folder = self._folder.parent
        require_own(file, [folder], named=file)
        with one_line(file, "attributes of N5"), open(file, "rb") as opened:
            return _parsed(opened.read(_MAX_BYTES))

    def numbered(self, stem: str) -> list[int]:
        """Return the numbers of the folders `STEM0`, `STEM1`, ... of a source on this machine."""
        if self._folder is None:
            return []
        parent, _, name = stem.rpartition("/")
        with os.scandir(f"{self._location.source}/{parent}") as entries:
            names = [entry.name for entry in entries if entry.is_dir()]
        numbers = (found.removeprefix(name) for found in names if found.startswith(name))
        return sorted(int(number) for number in numbers if number.isdecimal())

    def datasets(self, most: int) -> list[str]:
        """Return the paths of up to `most` datasets below a source on this machine, by name."""
        found: list[str] = []
        waiting = [""] if self._folder is not None else []
        for _ in range(_MAX_FOLDERS):
            if not waiting or len(found) >= most:
                break
            path = waiting.pop(0)
            if "dimensions" in self.attributes(path):
                found.append(path)
                continue
            with os.scandir(f"{self._location.source}/{path}") as entries:
                below = sorted(e.name for e in entries if e.is_dir(follow_symlinks=False))
            waiting += [f"{path}/{name}".lstrip("/") for name in below]
        return found


def _parsed(content: bytes | None) -> Mapping[str, Any]:
    found = load_json(content[:_MAX_BYTES], _NAME) if content is not None else {}
    if not isinstance(found, Mapping):
        raise SourceError(f"{_NAME}: found {type(found).__name__}, expected a table")
    return found
