"""The location of a source: a local path, or an address that fsspec opens."""

import os
import re
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import fsspec
from fsspec import AbstractFileSystem
from fsspec.asyn import AsyncFileSystem, sync
from fsspec.exceptions import FSTimeoutError

from stereocell.model.errors import SourceError, StereoCellError, UsageError
from stereocell.storage.first_bytes import HEAD_BYTES
from stereocell.storage.public_hosts import connects_to_public_alone

_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")  # a single colon may belong to a file's name
ANSWER_S = 25.0  # s; less than SILENCE_S, after which fsspec's http reports "does not exist"
_CONNECT_S, SILENCE_S = 15.0, 30.0  # s; limits of one request, which s3fs repeats
_AWS_CREDENTIALS = (
    "AWS_ACCESS_KEY_ID",
    "AWS_PROFILE",
    "AWS_WEB_IDENTITY_TOKEN_FILE",
    "AWS_CONTAINER_CREDENTIALS_RELATIVE_URI",
    "AWS_CONTAINER_CREDENTIALS_FULL_URI",
)


@dataclass(frozen=True, slots=True)
class Location:
    """The location of one source.

    source    absolute local path, or an address that format libraries understand; it ends in
              `:/KEY` if it names a dataset in a file
    is_local  whether it is a path on this machine
    """

    source: str
    is_local: bool

    @classmethod
    def of(cls, source: str | Path) -> "Location":
        """Return the location of a path or of an address such as `https://...` or `s3://...`.

        Raises UsageError for an invalid address, and for an empty text, which would mean the
        current folder.
        """
        text = str(source)
        if not text:
            raise UsageError(
                "path: found an empty name, expected a path or an address (. is the current folder)"
            )
        if not _ADDRESS.match(text):
            path, inside = _split(os.path.expanduser(text))
            return cls(os.path.abspath(path) + inside, True)
        try:
            parts = urlsplit(text)
        except ValueError as error:
            raise UsageError(
                f"{text}: found no address ({error}), expected https:// or s3://"
            ) from None
        if parts.scheme == "file":
            return cls(os.path.abspath(unquote(parts.path)), True)
        return cls(text, False)

    @property
    def path(self) -> str:
        """The file or folder on this machine without the part in `inside`; else the address."""
        return _split(self.source)[0] if self.is_local else self.source

    @property
    def inside(self) -> str:
        """The part of the source that names something inside a local file; empty: the whole file.

        It is `:/KEY`, or the rest of a path that leads into the file, such as `/0`.
        """
        return _split(self.source)[1] if self.is_local else ""

    @property
    def key(self) -> str:
        """The dataset in a file, such as `/a/b`; empty: none is named."""
        inside = self.inside
        return inside[1:] if inside.startswith(":") else ""

    @property
    def folder(self) -> Path:
        """The source's own folder with links followed. Its files must lie there or below."""
        path = Path(os.path.realpath(self.path))
        return path if path.is_dir() else path.parent

    @property
    def shown(self) -> str:
        """The source for messages, without an address's secrets (user, password, signature)."""
        if self.is_local:
            return self.source
        parts = urlsplit(self.source)
        host = parts.netloc.rpartition("@")[2]
        return f"{parts.scheme}://{host}{parts.path}"

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of the folders and the file along the path or address, without `/`."""
        path = self.shown.partition("://")[2]
        if self.is_local:
            file, inside = _split(self.source)
            path = file if inside.startswith(":") else self.source
        return tuple(part for part in path.split("/") if part)

    @property
    def storage_options(self) -> dict[str, Any]:
        """The options of fsspec for this address.

        s3: Requests are signed if this machine's environment holds credentials or `FSSPEC_S3`
        requires it; otherwise they are anonymous, which public buckets accept. The endpoint comes
        from the usual environment (`AWS_ENDPOINT_URL`). Timeouts of `FSSPEC_S3` take precedence.

        http: Only silence has a timeout; by default aiohttp stops any transfer after 5 minutes.
        Redirects of public hosts into a private network are refused. A process that reads for a
        stranger refuses all connections into a private network.
        """
        scheme = urlsplit(self.source).scheme
        if scheme in ("http", "https"):
            return _http_options()
        if scheme not in ("s3", "s3a"):
            return {}
        configured = fsspec.config.conf.get("s3", {})
        waits = {"connect_timeout": _CONNECT_S, "read_timeout": SILENCE_S}
        options = {"config_kwargs": {**waits, **configured.get("config_kwargs", {})}}
        if "anon" in configured:
            return {**options, "anon": configured["anon"]}
        files = (
            os.environ.get("AWS_SHARED_CREDENTIALS_FILE", "~/.aws/credentials"),
            os.environ.get("AWS_CONFIG_FILE", "~/.aws/config"),
        )
        signed = any(name in os.environ for name in _AWS_CREDENTIALS) or any(
            os.path.exists(os.path.expanduser(file)) for file in files
        )
        return {**options, "anon": not signed}


def _http_options() -> dict[str, Any]:
    """Return settings for aiohttp; the user's settings for fsspec override StereoCell's."""
    from aiohttp import ClientTimeout  # slow to import, and only the network needs it

    from stereocell.storage.http_hosts import checks, public_client

    waits = ClientTimeout(total=None, sock_connect=SILENCE_S, sock_read=SILENCE_S)
    configured: dict[str, Any] = {}
    for protocol in ("http", "https"):  # fsspec has one file system for both
        configured |= fsspec.config.conf.get(protocol, {}).get("client_kwargs", {})
    options = {"client_kwargs": {"timeout": waits, "trace_configs": checks(), **configured}}
    return {**options, "get_client": public_client} if connects_to_public_alone() else options


def does_answer(files: AbstractFileSystem, path: str) -> bool:
    """Return whether a store answers within ANSWER_S. An error is an answer, too.

    Requests are repeated, each with its own timeout. Without this limit a silent host that accepts
    connections would block for minutes.
    """
    if isinstance(files, AsyncFileSystem):
        try:
            sync(files.loop, files._exists, path, timeout=ANSWER_S)
        except FSTimeoutError:
            return False
        except Exception:  # the reader reports it with better words
            pass
    return True


def is_own(path: str | Path, folders: Sequence[Path]) -> bool:
    """Return whether a path lies in one of the folders or below, after following its links."""
    real = Path(os.path.realpath(path))
    return any(real.is_relative_to(folder) for folder in folders)


def require_own(
    path: str | Path,
    folders: Sequence[Path],
    *,
    named: str,
    raised: type[StereoCellError] = SourceError,
) -> os.stat_result | None:
    """Return the state of a file that a source refers to; None: it does not exist.

    Sources come from strangers, and results are published. A source may refer to a file by a path
    in its metadata or by a link. With links followed, it must be a regular file in one of the
    folders or below. Otherwise an error is raised and the file is not opened, because a pipe would
    block.

    named   words for the reference, for the message
    raised  class of the error
    """
    real = os.path.realpath(path)
    if not is_own(real, folders):
        raise raised(
            f"{named}: leads to {real}, expected a file in {folders[0]} or below (links are "
            "followed)"
        )
    try:
        status = os.stat(real)
    except OSError:  # the reader reports the missing file
        return None
    if not stat.S_ISREG(status.st_mode):
        raise raised(f"{named}: found a folder, device or pipe, expected a regular file")
    return status


def require_own_key(key: str, named: str) -> None:
    """Raise SourceError if a key leads out of the address that it is appended to.

    Stores of http accept `%2e%2e` for `..`, escaped any number of times.
    """
    found, steps = "", key
    while found != steps:
        found, steps = steps, unquote(steps)
    if ".." in re.split(r"[/\\?#]", steps):
        raise SourceError(f"{named}: leads out of the address, expected a key below it")


def _split(text: str) -> tuple[str, str]:
    """Return the file to which a local path leads, and the rest: `:/KEY`, or `/PATH` in the file.

    The rest is empty if the path exists as a whole, or does not lead to a file.
    """
    if not os.path.exists(text):
        for at in (place.start() for place in reversed([*re.finditer("[:/]", text)])):
            if os.path.isfile(text[:at]):
                rest = text[at:]
                return text[:at], f":/{rest[1:].lstrip('/')}" if rest[0] == ":" else rest
    return text, ""


def first_bytes(path: str, *, count: int = HEAD_BYTES) -> bytes:
    """Return the first bytes of a regular file; empty: it can't be read."""
    if not os.path.isfile(path):
        return b""
    try:
        with open(path, "rb") as file:
            return file.read(count)
    except OSError:
        return b""
