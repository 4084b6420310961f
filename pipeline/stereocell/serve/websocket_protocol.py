"""Limits on a websocket's frames before they form a message: pings, fragments and closing.

uvicorn answers every ping and waits for ever for a message's last fragment; here both have limits.
After a close frame the connection ends within _GONE_S, even if the client reads nothing. When the
server ends, it closes its clients with 1001, going away. serve/brick_session.py handles messages.

References: RFC 6455.
"""

import asyncio
import logging
from typing import Any

import uvicorn
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.datastructures import Headers
from websockets.frames import Frame
from websockets.http11 import Response
from websockets.server import ServerProtocol

from stereocell.serve.headers import protect
from stereocell.serve.http_protocol import State
from stereocell.serve.limits import (
    CONTROLS_PER_S,
    FRAGMENTS_S,
    MAX_FRAGMENTS,
    Bucket,
)

_GONE_S = 5.0  # s, longest time from our close frame to the end of the connection


class _Handshake(ServerProtocol):
    """The protocol of the websockets library, with the protective headers that all answers have."""

    def send_response(self, response: Response) -> None:
        raw = [(k.lower().encode(), v.encode("latin-1")) for k, v in response.headers.raw_items()]
        headers = Headers()
        for name, value in protect(raw):
            headers[name.decode().title()] = value.decode("latin-1")
        response.headers = headers
        super().send_response(response)


class GuardedSocket(WebSocketsSansIOProtocol):
    """uvicorn's websocket protocol with limits against malicious clients."""

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
        self.conn = _Handshake(max_size=config.ws_max_size, logger=logging.getLogger("websockets"))
        self._controls = Bucket(CONTROLS_PER_S)
        self._fragments = 0
        self._unfinished: asyncio.TimerHandle | None = None
        self._is_refused = False

    def connection_lost(self, exc: Exception | None) -> None:
        self._end_message()
        self._clients.leave(self.client[0] if self.client else "")
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if self._is_refused:
            return
        super().data_received(data)
        # uvicorn's HTTP passes a complete head to this class. If that starts no handshake, none
        # will follow.
        if not self.handshake_initiated:
            self.transport.abort()
        self._end_soon()

    def handle_text(self, event: Frame) -> None:
        self._begin_message(event)
        super().handle_text(event)

    def handle_bytes(self, event: Frame) -> None:
        self._begin_message(event)
        super().handle_bytes(event)

    def handle_cont(self, event: Frame) -> None:
        self._fragments += 1
        if event.fin:
            self._end_message()
        elif self._fragments > MAX_FRAGMENTS:
            self._refuse(1008, f"a message of more than {MAX_FRAGMENTS} frames")
        super().handle_cont(event)

    def handle_ping(self) -> None:
        if self._controls.take():
            super().handle_ping()
        else:
            self._refuse(1008, f"more than {CONTROLS_PER_S} pings a second")

    def handle_pong(self, event: Frame) -> None:
        if self._controls.take():
            super().handle_pong(event)
        else:
            self._refuse(1008, f"more than {CONTROLS_PER_S} pongs a second")

    def handle_parser_exception(self) -> None:
        """Send the reason, and end our side only.

        uvicorn closes at once. An operating system that closes a socket with unread bytes discards
        data that the client hasn't read yet, and so would lose the reason.
        """
        closing = self.conn.close_sent
        assert closing is not None
        self.queue.put_nowait(
            {"type": "websocket.disconnect", "code": closing.code, "reason": closing.reason}
        )
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.close_sent = self._is_refused = True
        if self.transport.can_write_eof():
            self.transport.write_eof()
            self.transport.resume_reading()
            self.close_timer = self.loop.call_later(_GONE_S, self.transport.abort)
        else:
            self.transport.close()  # a TLS transport waits for the client's close_notify

    def keepalive_timeout(self) -> None:
        super().keepalive_timeout()
        self._end_soon()

    def shutdown(self) -> None:
        if self.handshake_complete and not self.close_sent:
            self._refuse(1001, "the server ends")
        else:
            super().shutdown()

    def _begin_message(self, event: Frame) -> None:
        self._end_message()
        if not event.fin:
            self._fragments = 1
            reason = f"a message's last frame did not arrive within {FRAGMENTS_S:g} s"
            self._unfinished = self.loop.call_later(FRAGMENTS_S, self._refuse, 1008, reason)

    def _end_message(self) -> None:
        if self._unfinished is not None:
            self._unfinished.cancel()
            self._unfinished = None

    def _refuse(self, code: int, reason: str) -> None:
        """Close with a code and a reason; the application sees that the client has left."""
        if not self.close_sent and not self.transport.is_closing():
            self._end_message()
            self.stop_keepalive()
            self.conn.fail(code, reason)
            self.handle_parser_exception()
            self._end_soon()

    def _end_soon(self) -> None:
        if self.transport.is_closing() and not self.disconnected:
            self.loop.call_later(_GONE_S, self.transport.abort)
