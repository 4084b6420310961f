"""HTTP of an inbox: a few requests may have a body, of a limited size and within a deadline.

A body needs a Content-Length, so that its end is known before its first byte. The server cuts off a
sender that is silent for BODY_STALL_S or takes longer than BODY_S. The inbox keeps the bytes of an
upload that have arrived by then.
"""

import asyncio
import re

import h11

from stereocell.inbox.limits import PIECE_BYTES
from stereocell.serve.http_protocol import GuardedHttp
from stereocell.serve.limits import BODY_S, BODY_STALL_S, LIST_BYTES, SMALL_BYTES

# method, path and largest body in bytes; the first row that fits counts
_MOST = (
    ("POST", re.compile(r"/items"), LIST_BYTES),
    ("PATCH", re.compile(r"/items/[0-9a-f]{16}/bytes"), PIECE_BYTES),
    ("PUT", re.compile(r"/items/[0-9a-f]{16}/choices"), SMALL_BYTES),
    ("POST", re.compile(r"/items/[0-9a-f]{16}/[a-z]+"), SMALL_BYTES),
)


class InboxHttp(GuardedHttp):
    """The server's HTTP protocol, which accepts the bodies of an inbox's requests."""

    body_stall_s = BODY_STALL_S
    body_s = BODY_S
    _is_websocket = False
    _body_end: asyncio.TimerHandle | None = None
    _body_last_s = _body_began_s = 0.0

    def data_received(self, data: bytes) -> None:
        self._body_last_s = self.loop.time()
        super().data_received(data)
        self._await_body()

    def connection_lost(self, exc: Exception | None) -> None:
        self._end_body()
        super().connection_lost(exc)

    def on_response_complete(self) -> None:
        self._end_body()
        super().on_response_complete()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        # h11 stays in the state of a request whose body has not ended, but no body will come.
        self._is_websocket = True
        super().handle_websocket_upgrade(event)

    def _most_bytes(self) -> int:
        method, path = self.scope["method"], self.scope["path"]
        found = (most for name, form, most in _MOST if name == method and form.fullmatch(path))
        return next(found, 0)

    def _await_body(self) -> None:
        """Start the deadline of a body that has begun, or stop it if the body has ended."""
        is_body = self.conn.their_state is h11.SEND_BODY and not self._is_websocket
        if not is_body or self.transport.is_closing():
            self._end_body()
        elif self._body_end is None:
            self._body_began_s = self.loop.time()
            self._body_end = self.loop.call_later(self.body_stall_s, self._check_body)

    def _check_body(self) -> None:
        now, self._body_end = self.loop.time(), None
        if self.flow.read_paused:  # the delay is the server's: it is still writing to the disk
            self._body_last_s = now
        silent_s = now - self._body_last_s
        if silent_s >= self.body_stall_s or now - self._body_began_s >= self.body_s:
            self.transport.abort()
            return
        wait_s = min(self.body_stall_s - silent_s, self._body_began_s + self.body_s - now)
        self._body_end = self.loop.call_later(max(wait_s, 0.01), self._check_body)

    def _end_body(self) -> None:
        if self._body_end is not None:
            self._body_end.cancel()
            self._body_end = None
