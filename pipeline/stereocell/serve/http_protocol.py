"""The subset of HTTP that a bundle needs; all other requests are refused before processing.

uvicorn passes every request to the application, and closes those that it can't parse with 400. Here
a request must have one plain path, a head of limited size, and no body (413). A request without a
body can't smuggle in a second one. Only an inbox takes bodies (inbox_protocol.py). A client has a
limited number of connections and requests. A refused client may continue to send for LINGER_S: if
the socket closed at once, the client's system would discard the answer.

References: RFC 9112 (HTTP/1.1).
"""

import asyncio
import sys
from http import HTTPStatus
from typing import Any

import h11
import uvicorn
from uvicorn.server import ServerState

from stereocell.serve.deadline import HeadDeadline
from stereocell.serve.headers import protect
from stereocell.serve.limits import (
    HEAD_BYTES,
    LINGER_S,
    MAX_HEADERS,
    REQUESTS_PER_S,
    STALL_S,
    TARGET_BYTES,
    Clients,
)

_LINE_BYTES = 8 << 10  # bytes, largest header; the websockets library refuses longer ones
_VERSIONS = ("1.0", "1.1")
_LENGTH_DIGITS = 18  # most digits of a Content-Length


class State(ServerState):
    """The state that all connections of a server share."""

    def __init__(self) -> None:
        super().__init__()
        self.clients = Clients()


class _RefusedError(Exception):
    """Raised to answer the request with this status and to close its connection."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


class GuardedHttp(HeadDeadline):
    """uvicorn's HTTP protocol with limits against malicious clients."""

    stall_s = STALL_S
    _is_refused = False
    _is_counted = False
    _stalled: asyncio.TimerHandle | None = None

    def __init__(
        self,
        config: uvicorn.Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        assert isinstance(server_state, State)
        self._clients = server_state.clients

    # --- connections

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._is_counted = self._clients.enter(self._address)
        if not self._is_counted:
            self._refuse(_RefusedError(503, "too many connections are open, try again later"))
            self.transport.close()  # at once, since sockets or connections have run out

    def connection_lost(self, exc: Exception | None) -> None:
        if self._is_counted:
            self._clients.leave(self._address)
            self._is_counted = False
        self._end_stall()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self._is_counted = False  # from here on the websocket's protocol counts the connection
        super().handle_websocket_upgrade(event)

    @property
    def _address(self) -> str:
        return self.client[0] if self.client else ""

    def shutdown(self) -> None:
        if self._is_refused:
            self.transport.abort()
        else:
            super().shutdown()

    # --- requests

    def data_received(self, data: bytes) -> None:
        if not self._is_refused:
            super().data_received(data)

    def handle_events(self) -> None:
        try:
            super().handle_events()
        except _RefusedError as error:
            self._refuse(error)

    def _should_upgrade(self) -> bool:
        """Check the request; uvicorn calls this between the head and the answer."""
        self._judge()
        return super()._should_upgrade()

    def _judge(self) -> None:
        if not self._clients.ask(self._address):
            raise _RefusedError(429, f"more than {REQUESTS_PER_S} requests a second")
        scope, headers = self.scope, self.headers
        if scope["http_version"] not in _VERSIONS:
            raise _RefusedError(505, "this server speaks HTTP/1.1")
        target = len(scope["raw_path"]) + len(scope["query_string"])
        if target > TARGET_BYTES:
            raise _RefusedError(414, f"an address of more than {TARGET_BYTES} bytes")
        sizes = [len(name) + len(value) for name, value in headers]
        is_long = target + sum(sizes) > HEAD_BYTES or max(sizes, default=0) > _LINE_BYTES
        if is_long or len(sizes) > MAX_HEADERS:
            raise _RefusedError(
                431, f"more than {MAX_HEADERS} headers, {_LINE_BYTES} bytes of one or {HEAD_BYTES}"
            )
        if not scope["raw_path"].startswith(b"/"):
            raise _RefusedError(400, "expected the path of a file")
        names = {name for name, _ in headers}
        if {b"content-length", b"transfer-encoding"} <= names:
            raise _RefusedError(400, "both Content-Length and Transfer-Encoding")
        length = next((value for name, value in headers if name == b"content-length"), b"0")
        if most := self._most_bytes():
            self._judge_body(length, most, is_chunked=b"transfer-encoding" in names)
        elif b"transfer-encoding" in names or length.strip(b"0"):
            raise _RefusedError(413, "this server takes no bodies")
        if b"upgrade" in names and scope["method"] != "GET":
            raise _RefusedError(405, "websockets begin with GET")

    def _most_bytes(self) -> int:
        """Return the size in bytes of the largest body that the request may have."""
        return 0

    def _judge_body(self, length: bytes, most: int, *, is_chunked: bool) -> None:
        if is_chunked:
            raise _RefusedError(411, "expected a Content-Length")
        # h11 has already refused a length that does not consist of digits.
        if len(length) > _LENGTH_DIGITS or int(length) > most:
            raise _RefusedError(413, f"a body of more than {most} bytes")

    def send_400_response(self, msg: str) -> None:
        """Answer a request that can't be parsed; uvicorn calls this while it handles h11's error.

        The answer has no text: the request may have been a HEAD, whose answer has no body.
        """
        status = getattr(sys.exception(), "error_status_hint", 400)
        if status == 431 and b"\n" not in self.conn.trailing_data[0]:
            status = 414
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            self._refuse(_RefusedError(status, ""))
        else:
            self.transport.abort()

    def _refuse(self, error: _RefusedError) -> None:
        self._is_refused = True
        self._stop()
        self._unset_keepalive_if_required()
        text = f"{error}\n".encode() if str(error) else b""
        headers = [
            (b"content-type", b"text/plain; charset=utf-8"),
            (b"content-length", str(len(text)).encode()),
            (b"cache-control", b"no-store"),
            (b"connection", b"close"),
        ]
        if error.status in (429, 503):
            headers.append((b"retry-after", b"1"))
        if error.status == 405:
            headers.append((b"allow", b"GET, HEAD"))
        answer = h11.Response(
            status_code=error.status,
            headers=protect(self.server_state.default_headers + headers),
            reason=HTTPStatus(error.status).phrase.encode(),
        )
        # The answer to a HEAD states the length of the text and omits the text.
        is_head = self.scope is not None and self.scope["method"] == "HEAD"
        for event in (answer, h11.Data(data=b"" if is_head else text), h11.EndOfMessage()):
            self.transport.write(self.conn.send(event) or b"")
        if self.transport.can_write_eof():
            self.transport.write_eof()
            self.transport.resume_reading()
        else:
            self.transport.close()  # a TLS transport waits for the client's close_notify
        self.loop.call_later(LINGER_S, self.transport.abort)

    # --- answers that the client doesn't read

    def pause_writing(self) -> None:
        super().pause_writing()
        self._await_progress()

    def resume_writing(self) -> None:
        self._end_stall()
        super().resume_writing()

    def timeout_keep_alive_handler(self) -> None:
        super().timeout_keep_alive_handler()
        self.loop.call_later(self.stall_s, self.transport.abort)

    def _await_progress(self) -> None:
        left = self.transport.get_write_buffer_size()
        self._stalled = self.loop.call_later(self.stall_s, self._check_progress, left)

    def _check_progress(self, left: int) -> None:
        if self.transport.get_write_buffer_size() >= left:
            self.transport.abort()
        else:
            self._await_progress()

    def _end_stall(self) -> None:
        if self._stalled is not None:
            self._stalled.cancel()
            self._stalled = None
