"""Serve the files of a bundle: types, byte ranges, 304 for cached files, nothing outside the root.

If a compressed file such as `index.html.br` or `.gz` lies beside a file, clients that accept the
encoding get that one. A byte range always means bytes of the uncompressed file.

The viewer fetches single mip levels by ranges. A Range header that is malformed, in another unit,
or asks for several ranges is ignored, as the RFC allows: the answer is the whole file. All answers
are `no-cache`, since a new build may replace the bundle at any time.

References: RFC 9110, sections 14 (range requests) and 12.5.3 (Accept-Encoding).
"""

import os
import re
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import quote

import anyio.to_thread
import h11
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.types import Receive, Scope, Send

from stereocell.formats.media_types import media_type
from stereocell.serve.headers import policy

_HEADERS = {"Cache-Control": "no-cache"}
_ENCODINGS = {"br": ".br", "gzip": ".gz"}  # br comes first, since its files are smaller
_RANGE = re.compile(r"bytes=(\d*)-(\d*)", re.ASCII)
_DIGITS = 18  # digits of a number in a Range header: no file has more bytes


def bricks_header(folder: str = "") -> dict[str, str]:
    """Return the header that announces `/bricks`, or the bricks of a folder such as `g1/`."""
    return {"Stereocell-Bricks": "version=1" + (f"; folder={folder}" if folder else "")}


class ShrunkError(Exception):
    """A file became shorter while it was sent."""


class _SentFile(FileResponse):
    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        except h11.LocalProtocolError as error:  # fewer bytes than the answer's head announced
            raise ShrunkError(f"{self.path}: the file became shorter while it was sent") from error


class BundleFiles:
    """Serves the files of a folder, with headers that announce the server's other services."""

    def __init__(self, folder: Path, announced: Mapping[str, str]) -> None:
        self._root = folder.resolve()
        self._headers = {**_HEADERS, **announced}

    async def answer(self, request: Request) -> Response:
        """Answer a GET or HEAD."""
        found = await anyio.to_thread.run_sync(self._find, request.scope["path"])
        if found is None:
            return PlainTextResponse("not found", 404)
        path, status = found
        kind = media_type(path)
        headers = {**self._headers, **policy(kind)}
        beside = await anyio.to_thread.run_sync(_compressed, path)
        if beside:
            headers["Vary"] = "Accept-Encoding"
        if "range" not in request.headers:
            accepted = accepted_encodings(request.headers.get("accept-encoding", ""))
            encoding = next((name for name in beside if name in accepted), None)
            if encoding is not None:
                path, status = beside[encoding]
                headers["Content-Encoding"] = encoding
        response = _SentFile(path, headers=headers, media_type=kind, stat_result=status)
        response.headers["content-type"] = kind
        tag = response.headers["etag"]
        if tag in [known.strip() for known in request.headers.get("if-none-match", "").split(",")]:
            return Response(status_code=304, headers={**headers, "ETag": tag})
        _plain_range(request, status.st_size)
        return response

    def _find(self, name: str) -> tuple[Path, os.stat_result] | None:
        """Return the file at a path; None if the root contains no such file."""
        if "\0" in name:
            return None
        try:
            path = (self._root / name.lstrip("/")).resolve()
            if path.is_dir():
                path = (path / "index.html").resolve()
            if not path.is_relative_to(self._root) or not path.is_file():
                return None
            return path, path.stat()
        except (OSError, RuntimeError):  # a long name, a forbidden folder, a circle of links
            return None


def _compressed(path: Path) -> dict[str, tuple[Path, os.stat_result]]:
    """Return the compressed versions that lie beside a file, by encoding."""
    found = {}
    for encoding, suffix in _ENCODINGS.items():
        beside = path.with_name(path.name + suffix)
        if beside.is_file() and not beside.is_symlink():
            found[encoding] = beside, beside.stat()
    return found


def accepted_encodings(header: str) -> set[str]:
    """Return the encodings that an Accept-Encoding header names and does not forbid by `q=0`."""
    accepted = set()
    for part in header.lower().split(","):
        name, _, parameter = part.partition(";")
        weight = parameter.replace(" ", "").removeprefix("q=")
        if weight.strip("0.") or not parameter.strip():
            accepted.add(name.strip())
    return accepted


def parse_range(header: str, size: int) -> range | None:
    """Return the bytes that a Range header asks for, clipped to a file of `size` bytes.

    An empty range can't be satisfied. None means that the header is to be ignored: it is malformed,
    in another unit, or asks for several ranges, which a server may answer with the whole file.

    >>> parse_range("bytes=100-199", 150)
    range(100, 150)
    """
    match = _RANGE.fullmatch(header.strip())
    if match is None or max(map(len, match.groups())) > _DIGITS:
        return None
    first, last = match.groups()
    if first:
        if last and int(last) < int(first):
            return None
        return range(int(first), min(int(last) + 1, size) if last else size)
    if last:
        return range(max(0, size - int(last)), size)
    return None


def _plain_range(request: Request, size: int) -> None:
    """Replace the request's Range header by one that FileResponse understands, or remove it."""
    headers = [(key, value) for key, value in request.scope["headers"] if key != b"range"]
    asked = parse_range(request.headers.get("range", ""), size)
    if asked is not None:
        last = max(asked.stop - 1, asked.start)
        headers.append((b"range", f"bytes={asked.start}-{last}".encode()))
    request.scope["headers"] = headers


def redirect(path: str) -> Response:
    """Return a redirect to a path of this server, which no cache stores.

    Repeated slashes become one, since a browser takes the part after a leading `//` for a host.
    """
    place = quote(re.sub("/+", "/", f"/{path}"))  # quote also encodes ":" and backslashes
    return Response(status_code=303, headers={"Location": place, "Cache-Control": "no-store"})
