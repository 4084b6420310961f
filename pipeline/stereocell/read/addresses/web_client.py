"""Fetch answers of services, limited in bytes and time, and only from public hosts."""

import http.client
import json
import socket
import ssl
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote, urljoin, urlsplit

from stereocell.model.errors import SourceError
from stereocell.read.addresses.resolved import NotThereError, wrong_answer
from stereocell.storage.location import SILENCE_S
from stereocell.storage.public_hosts import (
    numbers_of,
    origin_of,
    public_numbers_of,
    split_address,
)

ANSWER_BYTES = 16 << 20  # bytes of the largest answer in JSON or XML
ANSWER_S = 60.0  # s for an answer in JSON or XML, from its first byte to its last
_REDIRECTS = 5
_BLOCK_BYTES = 1 << 18
_MOVED = (301, 302, 303, 307, 308)
_NO_LOGIN = "expected data that are open to all"


class WebClient:
    """Asks the hosts of one service, and follows redirects to public hosts.

    own    addresses of the service, or of the user: only their hosts may have private IP addresses
    token  secret for the first of these origins; no other host gets it, not even by a redirect
    login  remedy where a host requires a login
    shown  name of the service for messages; it contains no secret and no identity
    """

    def __init__(
        self, own: Sequence[str], *, shown: str, token: str = "", login: str = _NO_LOGIN
    ) -> None:
        self._own = [origin_of(address) for address in own]
        self._token, self._login, self.shown = token, login, shown

    def fetch(self, address: str, accept: str, *, post: bytes | None = None) -> bytes:
        """Return a small answer. Raises NotThereError and SourceError."""
        with self.opened(address, accept, post=post) as response:
            body, end_s = bytearray(), time.monotonic() + ANSWER_S
            for block in self.blocks(response):
                body += block
                if len(body) > ANSWER_BYTES:
                    raise wrong_answer(
                        self.shown,
                        f"more than {ANSWER_BYTES >> 20} MiB",
                        f"at most {ANSWER_BYTES >> 20} MiB",
                    )
                if time.monotonic() > end_s:
                    raise wrong_answer(
                        self.shown, f"no end within {ANSWER_S:g} s", "a server that responds"
                    )
        return bytes(body)

    def fetch_json(
        self, address: str, *, accept: str = "application/json", post: Any = None
    ) -> Any:
        """Return the values of an answer in JSON; None: the answer is empty."""
        sent = None if post is None else json.dumps(post).encode()
        body = self.fetch(address, accept, post=sent)
        if not body.strip():
            return None
        if body.lstrip()[:1] == b"<":
            raise wrong_answer(self.shown, "a web page", "JSON: does this address need a login?")
        try:
            return json.loads(body)
        except (ValueError, RecursionError):
            raise wrong_answer(self.shown, "damaged JSON", "JSON") from None

    def is_there(self, address: str) -> bool:
        """Return whether a file lies at an address. HTTP 401 and 403 count as missing."""
        try:
            with self.opened(address, "*/*", refused=NotThereError):
                return True
        except NotThereError:
            return False

    def save(self, address: str, path: Path, *, limit: int) -> int:
        """Write a file of at most `limit` bytes; return its size. Raises SourceError."""
        size = 0
        with self.opened(address, "*/*") as response, open(path, "xb") as file:
            expected = response.length
            for block in self.blocks(response):
                size += len(block)
                if size > limit:
                    raise wrong_answer(self.shown, "a larger file", f"at most {limit} bytes")
                file.write(block)
        if expected is not None and size != expected:
            raise wrong_answer(self.shown, f"{size} bytes", f"{expected} bytes: it was cut off")
        return size

    def blocks(self, response: http.client.HTTPResponse) -> Iterator[bytes]:
        """Yield the bytes of an answer as they arrive. Raises SourceError where it breaks off."""
        while True:
            with self._one_line():
                block = response.read1(_BLOCK_BYTES)
            if not block:
                return
            yield block

    @contextmanager
    def opened(
        self,
        address: str,
        accept: str,
        *,
        post: bytes | None = None,
        refused: type[SourceError] = SourceError,
    ) -> Iterator[http.client.HTTPResponse]:
        """Yield the answer of an address, or of the one that it is redirected to.

        refused  error that is raised where a login is required
        """
        for _ in range(1 + _REDIRECTS):
            with ExitStack() as stack:
                connection = stack.enter_context(closing(self._connect(address)))
                with self._one_line():
                    response = self._ask(connection, address, accept, post)
                # the response may hold the connection's socket itself
                stack.callback(response.close)
                if response.status not in _MOVED:
                    self._require_answer(response, refused)
                    yield response
                    return
                address = self._redirected(address, response, post)
        raise wrong_answer(self.shown, f"more than {_REDIRECTS} redirects", "data")

    def _redirected(
        self, address: str, response: http.client.HTTPResponse, post: bytes | None
    ) -> str:
        target = urljoin(address, response.headers.get("Location", ""))
        if target == address or post is not None:
            raise wrong_answer(self.shown, "a redirect that leads nowhere", "data")
        if urlsplit(address).scheme == "https" and urlsplit(target).scheme != "https":
            raise wrong_answer(self.shown, "a redirect from https:// to another scheme", "https://")
        return target

    def _connect(self, address: str) -> http.client.HTTPConnection:
        scheme, host, port = origin = origin_of(address)
        numbers = numbers_of(address) if origin in self._own else public_numbers_of(address)
        with self._one_line():
            # Connect to the checked IP addresses: the name may lead to other ones a moment later.
            opened = _connected(numbers, port)
            connection: http.client.HTTPConnection
            if scheme == "http":
                connection = http.client.HTTPConnection(host, port)
            else:
                connection = http.client.HTTPSConnection(host, port)
                opened = _secured(opened, host)
            connection.sock = opened
        return connection

    def _ask(
        self, connection: http.client.HTTPConnection, address: str, accept: str, post: bytes | None
    ) -> http.client.HTTPResponse:
        parts = split_address(address)
        target = quote(parts.path or "/", safe="/%:@!$&'()*+,;=~")
        if parts.query:
            target += "?" + quote(parts.query, safe="/%:@!$&'()*+,;=~?")
        headers: Mapping[str, str] = {"Accept": accept, "Accept-Encoding": "identity"}
        if self._token and origin_of(address) == self._own[0]:
            headers = {**headers, "Authorization": f"Bearer {self._token}"}
        if post is not None:
            headers = {**headers, "Content-Type": "application/json"}
        connection.request("GET" if post is None else "POST", target, post, dict(headers))
        return connection.getresponse()

    def _require_answer(
        self, response: http.client.HTTPResponse, refused: type[SourceError]
    ) -> None:
        status = response.status
        if status in (401, 403):
            raise refused(f"{self.shown}: no access (HTTP {status}), {self._login}")
        if status in (404, 410):
            raise NotThereError(
                f"{self.shown}: not found (HTTP {status}), expected another address"
            )
        if not 200 <= status < 300 or status == 206:
            raise wrong_answer(self.shown, f"HTTP {status}", "HTTP 200")
        if response.headers.get("Content-Encoding", "identity").lower() != "identity":
            raise wrong_answer(self.shown, "compressed bytes", "uncompressed bytes, as requested")

    @contextmanager
    def _one_line(self) -> Iterator[None]:
        try:
            yield
        except TimeoutError:
            raise SourceError(
                f"{self.shown}: no answer within {SILENCE_S:g} s, expected a server that responds"
            ) from None
        except http.client.IncompleteRead:
            raise wrong_answer(self.shown, "an end before its last byte", "all bytes") from None
        except (http.client.HTTPException, ValueError) as error:
            raise wrong_answer(self.shown, type(error).__name__, "HTTP") from None
        except OSError as error:
            words = error.strerror or type(error).__name__
            raise SourceError(
                f"{self.shown}: {words:.160}, expected a server that responds"
            ) from None


def _connected(numbers: Sequence[str], port: int) -> socket.socket:
    """Return a connection to the first of some IP addresses that accepts one."""
    last: OSError = OSError("no address")
    for number in numbers:
        try:
            return socket.create_connection((number, port), timeout=SILENCE_S)
        except OSError as error:
            last = error
    raise last


def _secured(opened: socket.socket, host: str) -> ssl.SSLSocket:
    try:
        return ssl.create_default_context().wrap_socket(opened, server_hostname=host)
    except BaseException:
        opened.close()
        raise
