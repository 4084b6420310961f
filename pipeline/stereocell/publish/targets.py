"""Where a bundle is put: files by their paths below one folder or address."""

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

# names that hold a hash of their content may be kept for ever; all others are asked for again,
# which costs a round trip and no bytes where nothing has changed
FOREVER, AGAIN = "public, max-age=31536000, immutable", "no-cache"
_S3 = ("s3", "s3a")


class Target(Protocol):
    """Files at a host. Paths have forward slashes; all methods raise OutputError."""

    shown: str
    at_once: int  # files that may be written at a time

    @property
    def address(self) -> str | None:
        """The address at which browsers find it, with a slash at its end; None: unknown."""

    def sizes(self) -> dict[str, int]:
        """Return all files that are there, whoever put them, with their bytes."""

    def read(self, path: str) -> bytes:
        """Return a file's content."""

    def write(self, path: str, content: bytes) -> None:
        """Put a file there, whole or not at all."""

    def remove(self, path: str) -> None:
        """Remove a file."""


def target_of(text: str, *, is_public: bool) -> Target:
    """Return the target of a folder's path or of an address, as `s3://bucket/specimen`."""
    location = Location.of(text)
    if location.is_local:
        return FolderTarget(Path(location.source))
    if urlsplit(text).scheme in ("http", "https"):
        raise OutputError(
            f"{location.shown}: nothing can be put there by http, "
            "expected a folder or an address as s3://bucket/name"
        )
    return StoreTarget(location, is_public)


def cache_control(path: str) -> str:
    """Return how long a browser may keep a file: the viewer's assets have a hash in their names."""
    return FOREVER if PurePosixPath(path).parts[0] == "assets" else AGAIN


class FolderTarget:
    """A folder of this machine: of a web server, or of a checked out `gh-pages` branch."""

    address = None
    at_once = 1  # files at a time: in a folder each writer clears what killed writers have left

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.shown = str(folder)

    def sizes(self) -> dict[str, int]:
        """Return all files below the folder, but for those of git."""
        if self.folder.exists() and not self.folder.is_dir():
            raise OutputError(f"{self.folder}: is a file, expected a folder")
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
        """Put a file there, whole or not at all."""
        write_bytes(self._own(path), content)

    def remove(self, path: str) -> None:
        """Remove a file, and the folders that have nothing else in them."""
        file = self._own(path)
        with one_line(str(file), "a file that may be removed", raised=OutputError):
            file.unlink(missing_ok=True)
        for folder in file.relative_to(self.folder).parents[:-1]:
            with suppress(OSError):  # something else is in it
                (self.folder / folder).rmdir()

    def _own(self, path: str) -> Path:
        """Return a file's place. A link in TARGET may not lead out of it."""
        file = self.folder / path
        if not is_own(file.parent, [Path(os.path.realpath(self.folder))]):
            raise OutputError(
                f"{file}: leads to {os.path.realpath(file.parent)}, expected a place in TARGET"
            )
        return file


class StoreTarget:
    """What fsspec opens: object storage, mostly."""

    at_once = 8  # most of a request is waiting

    def __init__(self, location: Location, is_public: bool) -> None:
        self.location = location
        self.shown = location.shown.rstrip("/")
        self.scheme = urlsplit(location.source).scheme
        self.is_public = is_public

    @cached_property
    def _storage(self) -> tuple[Any, str]:
        """The file system of fsspec, and the target's path in it."""
        import fsspec

        with self._telling(""):
            fs, path = fsspec.core.url_to_fs(
                self.location.source, use_listings_cache=False, **self.location.storage_options
            )
        if not does_answer(fs, path):
            raise OutputError(
                f"{self.shown}: no answer within {ANSWER_S:g} s, expected a store that is up"
            )
        return fs, str(path).rstrip("/")

    @contextmanager
    def _telling(self, path: str) -> Iterator[None]:
        where = f"{self.shown}/{path}".rstrip("/")
        with one_line(where, "a place that this machine may write to", raised=OutputError):
            try:
                yield
            except ImportError as error:
                raise OutputError(f"{self.shown}: {error}") from None

    @property
    def address(self) -> str | None:
        """The address of S3 itself, or of the store that stands for it here."""
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
        """Return all objects below the address."""
        fs, base = self._storage
        with self._telling(""):
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
        with self._telling(path):
            content: bytes = fs.cat_file(f"{base}/{path}")
        return content

    def write(self, path: str, content: bytes) -> None:
        """Put an object there: on S3 with its type, and how long it may be kept."""
        fs, base = self._storage
        headers = {}
        if self.scheme in _S3:
            headers = {
                "ContentType": media_type(PurePosixPath(path)),
                "CacheControl": cache_control(path),
            }
            if self.is_public:
                headers["ACL"] = "public-read"
        with self._telling(path):
            if not headers and "/" in path:
                fs.makedirs(f"{base}/{path}".rpartition("/")[0], exist_ok=True)
            fs.pipe_file(f"{base}/{path}", content, **headers)

    def remove(self, path: str) -> None:
        """Remove an object."""
        fs, base = self._storage
        with self._telling(path), suppress(FileNotFoundError):
            fs.rm_file(f"{base}/{path}")


def digest(content: bytes) -> str:
    """Return the SHA-256 of a file's content."""
    return hashlib.sha256(content).hexdigest()
