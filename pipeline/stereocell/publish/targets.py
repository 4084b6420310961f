"""The target of publishing: reads and writes files by their paths below a folder or an address."""

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any, Protocol
from urllib.parse import quote, urlsplit

from stereocell.formats.media_types import media_type
from stereocell.model.errors import OutputError
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import ANSWER_S, Location, does_answer, is_own

# Browsers may cache a file for ever if its name contains a hash of its content. They ask again for
# all other files. That costs a round trip, but no bytes if nothing has changed.
FOREVER, AGAIN = "public, max-age=31536000, immutable", "no-cache"
_S3 = ("s3", "s3a")


class Target(Protocol):
    """Files at a host. Paths have forward slashes. All methods may raise OutputError."""

    shown: str
    at_once: int  # files that may be written at a time

    @property
    def address(self) -> str | None:
        """The address at which browsers find the files, ending in a slash; None if unknown."""

    def sizes(self) -> dict[str, int]:
        """Return the size in bytes of each file at the target, by path, also of files of others."""

    def read(self, path: str) -> bytes:
        """Return a file's content."""

    def write(self, path: str, content: bytes) -> None:
        """Write a file in one step, so that no reader sees a part of it."""

    def remove(self, path: str) -> None:
        """Remove a file."""


def target_of(text: str, *, is_public: bool) -> Target:
    """Return the target for a folder's path or for an address such as `s3://bucket/specimen`."""
    location = Location.of(text)
    if location.is_local:
        return FolderTarget(Path(location.source))
    if urlsplit(text).scheme in ("http", "https"):
        raise OutputError(
            f"{location.shown}: files can't be written over http, "
            "expected a folder or an address such as s3://bucket/name"
        )
    return StoreTarget(location, is_public)


def cache_control(path: str) -> str:
    """Return the Cache-Control header of a file. The viewer's assets have hashes in their names."""
    return FOREVER if PurePosixPath(path).parts[0] == "assets" else AGAIN


class FolderTarget:
    """A folder of this machine: of a web server, or of a checked out `gh-pages` branch."""

    address = None
    at_once = 1  # each write to a folder removes temporary files, also those of a parallel write

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.shown = str(folder)

    def sizes(self) -> dict[str, int]:
        """Return the size in bytes of each file below the folder, by path, except git's."""
        if self.folder.exists() and not self.folder.is_dir():
            raise OutputError(f"{self.folder}: found a file, expected a folder")
        return {
            file.relative_to(self.folder).as_posix(): file.stat().st_size
            for file in sorted(self.folder.rglob("*"))
            if file.is_file() and ".git" not in file.relative_to(self.folder).parts
        }

    def read(self, path: str) -> bytes:
        """Return a file's content."""
        with one_line(str(self.folder / path), "a file that can be read", raised=OutputError):
            return self._own(path).read_bytes()

    def write(self, path: str, content: bytes) -> None:
        """Write a file in one step, so that no reader sees a part of it."""
        write_bytes(self._own(path), content)

    def remove(self, path: str) -> None:
        """Remove a file, and the folders that become empty."""
        file = self._own(path)
        with one_line(str(file), "a file that may be removed", raised=OutputError):
            file.unlink(missing_ok=True)
        for folder in file.relative_to(self.folder).parents[:-1]:
            with suppress(OSError):  # the folder is not empty
                (self.folder / folder).rmdir()

    def _own(self, path: str) -> Path:
        """Return a file's path. Raises OutputError if a link leads out of the target."""
        file = self.folder / path
        if not is_own(file.parent, [Path(os.path.realpath(self.folder))]):
            raise OutputError(
                f"{file}: leads to {os.path.realpath(file.parent)}, expected a place in TARGET"
            )
        return file


class StoreTarget:
    """A target that fsspec opens, mostly object storage."""

    at_once = 8  # parallel requests, since most of a request is waiting

    def __init__(self, location: Location, is_public: bool) -> None:
        self.location = location
        self.shown = location.shown.rstrip("/")
        self.scheme = urlsplit(location.source).scheme
        self.is_public = is_public

    @cached_property
    def _storage(self) -> tuple[Any, str]:
        """The file system of fsspec that the target is in, and the target's path in it."""
        import fsspec

        with self._in_one_line(""):
            fs, path = fsspec.core.url_to_fs(
                self.location.source, use_listings_cache=False, **self.location.storage_options
            )
        if not does_answer(fs, path):
            raise OutputError(
                f"{self.shown}: no answer within {ANSWER_S:g} s, expected a store that is up"
            )
        return fs, str(path).rstrip("/")

    @contextmanager
    def _in_one_line(self, path: str) -> Iterator[None]:
        """Turn errors of the store into an OutputError of one line."""
        where = f"{self.shown}/{path}".rstrip("/")
        with one_line(where, "a place that this machine may write to", raised=OutputError):
            try:
                yield
            except ImportError as error:
                raise OutputError(f"{self.shown}: {error}") from None

    @property
    def address(self) -> str | None:
        """The address at S3, or at the S3-compatible store that this machine is configured for."""
        if self.scheme not in _S3:
            return None
        fs, path = self._storage
        bucket, _, key = path.partition("/")
        key = f"{quote(key)}/" if key else ""
        endpoint = fs.client_kwargs.get("endpoint_url") or fs.endpoint_url
        endpoint = endpoint or os.environ.get("AWS_ENDPOINT_URL_S3")
        endpoint = endpoint or os.environ.get("AWS_ENDPOINT_URL")
        if endpoint:
            return f"{endpoint.rstrip('/')}/{bucket}/{key}"
        host = "s3.amazonaws.com"
        return (
            f"https://{host}/{bucket}/{key}" if "." in bucket else f"https://{bucket}.{host}/{key}"
        )

    def sizes(self) -> dict[str, int]:
        """Return the size in bytes of each object below the address, by path."""
        fs, base = self._storage
        with self._in_one_line(""):
            try:
                found = fs.find(base, detail=True)
            except FileNotFoundError:
                return {}
        return {
            str(key)[len(base) :].lstrip("/"): int(about["size"]) for key, about in found.items()
        }

    def read(self, path: str) -> bytes:
        """Return an object's content."""
        fs, base = self._storage
        with self._in_one_line(path):
            content: bytes = fs.cat_file(f"{base}/{path}")
        return content

    def write(self, path: str, content: bytes) -> None:
        """Write an object. On S3 its media type and Cache-Control are set, too."""
        fs, base = self._storage
        headers = {}
        if self.scheme in _S3:
            headers = {
                "ContentType": media_type(PurePosixPath(path)),
                "CacheControl": cache_control(path),
            }
            if self.is_public:
                headers["ACL"] = "public-read"
        with self._in_one_line(path):
            if not headers and "/" in path:
                fs.makedirs(f"{base}/{path}".rpartition("/")[0], exist_ok=True)
            fs.pipe_file(f"{base}/{path}", content, **headers)

    def remove(self, path: str) -> None:
        """Remove an object."""
        fs, base = self._storage
        with self._in_one_line(path), suppress(FileNotFoundError):
            fs.rm_file(f"{base}/{path}")


def digest(content: bytes) -> str:
    """Return the SHA-256 of a file's content."""
    return hashlib.sha256(content).hexdigest()
