"""Serve a built bundle on this machine alone, with HTTP byte ranges, for `stereocell view`.

The standard library's file handler knows no ranges, by which the viewer fetches single mip levels
(RFC 9110, section 14), and none of our dependencies serves files with them; hence this small
handler. It listens on 127.0.0.1 only, answers GET and HEAD only, refuses every path that leads out
of the directory (also by a symbolic link) and requests that name another host (DNS rebinding).
"""

import re
import webbrowser
from contextlib import suppress
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import BinaryIO
from urllib.parse import unquote, urlsplit

from rich.console import Console

from stereocell.errors import StereoCellError

HOST = "127.0.0.1"
_OWN_NAMES = {HOST, "localhost"}  # any port: it may be forwarded
_TYPES = {
    ".css": "text/css; charset=utf-8",
    ".glb": "model/gltf-binary",
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".ktx2": "image/ktx2",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".wasm": "application/wasm",
    ".webmanifest": "application/manifest+json",
}
_RANGE = re.compile(r"bytes=(\d*)-(\d*)")
_BLOCK = 1 << 16


def serve(directory: Path, port: int, open_browser: bool) -> None:
    """Serve the bundle in `directory` until Ctrl+C; port 0 takes a free one.

    Raises StereoCellError if there is no bundle, or the port is taken.
    """
    with make_server(directory, port) as server:
        address = f"http://localhost:{server.server_port}/"
        Console().print(f"{address} shows {directory}; Ctrl+C ends it", soft_wrap=True)
        if open_browser:
            webbrowser.open(address)
        with suppress(KeyboardInterrupt):
            server.serve_forever()


def make_server(directory: Path, port: int) -> ThreadingHTTPServer:
    """Return a bound server of the bundle in `directory`; the caller runs and closes it.

    Raises StereoCellError if there is no bundle, or the port is taken.
    """
    for name in ("manifest.json", "index.html"):
        if not (directory / name).is_file():
            raise StereoCellError(
                f"{directory / name}: expected a built bundle, found no such file; "
                "`stereocell bundle OUT` writes it"
            )
    try:
        return ThreadingHTTPServer((HOST, port), partial(_Handler, root=directory.resolve()))
    except (OSError, OverflowError) as error:
        raise StereoCellError(
            f"port {port}: {error}; choose another, or 0 for a free one"
        ) from error


def parse_range(header: str, size: int) -> range | None:
    """Return the bytes that a Range header asks for, clipped to a file of `size` bytes.

    An empty range can't be satisfied. None: the header is to be ignored (it is malformed, in
    another unit, or asks for several ranges, which a server may answer with the whole file).
    """
    match = _RANGE.fullmatch(header.strip())
    if match is None:
        return None
    first, last = match.groups()
    if first:
        if last and int(last) < int(first):
            return None
        return range(int(first), min(int(last) + 1, size) if last else size)
    if last:
        return range(max(0, size - int(last)), size)
    return None


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_version = "stereocell"

    def __init__(self, *args: object, root: Path) -> None:
        self.root = root
        super().__init__(*args)  # type: ignore[arg-type]

    def do_GET(self) -> None:
        self._answer(with_body=True)

    def do_HEAD(self) -> None:
        self._answer(with_body=False)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing: hundreds of tiles would hide the one line that matters."""

    def _answer(self, with_body: bool) -> None:
        # A browser that no longer wants a tile closes the connection in the middle of it.
        with suppress(ConnectionError):
            if self.headers.get("Host", "").rsplit(":", 1)[0] not in _OWN_NAMES:
                self.send_error(HTTPStatus.FORBIDDEN, "this server answers to localhost only")
                return
            path = self._find()
            if path is None:
                self.send_error(HTTPStatus.NOT_FOUND)
                return
            with path.open("rb") as file:
                self._send(path, file, with_body)

    def _find(self) -> Path | None:
        """Return the file that the request names; None: there is none inside the root."""
        name = unquote(urlsplit(self.path).path)
        if "\0" in name:
            return None
        path = (self.root / name.lstrip("/")).resolve()
        if path.is_dir():
            path = (path / "index.html").resolve()
        if not path.is_relative_to(self.root) or not path.is_file():
            return None
        return path

    def _send(self, path: Path, file: BinaryIO, with_body: bool) -> None:
        size = path.stat().st_size
        asked = parse_range(self.headers["Range"], size) if "Range" in self.headers else None
        if asked is not None and len(asked) == 0:
            self.send_response(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE)
            self.send_header("Content-Range", f"bytes */{size}")
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        part = range(size) if asked is None else asked
        self.send_response(HTTPStatus.OK if asked is None else HTTPStatus.PARTIAL_CONTENT)
        self.send_header("Content-Type", _TYPES.get(path.suffix, "application/octet-stream"))
        self.send_header("Content-Length", str(len(part)))
        if asked is not None:
            self.send_header("Content-Range", f"bytes {part.start}-{part.stop - 1}/{size}")
        self.send_header("Accept-Ranges", "bytes")
        self.send_header("Cache-Control", "no-cache")  # the bundle may be built anew meanwhile
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        if with_body:
            self._copy(file, part)

    def _copy(self, file: BinaryIO, part: range) -> None:
        file.seek(part.start)
        left = len(part)
        while left > 0 and (block := file.read(min(_BLOCK, left))):
            self.wfile.write(block)
            left -= len(block)
