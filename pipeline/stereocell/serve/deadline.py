"""Close connections that send no request: uvicorn itself keeps them open for ever.

uvicorn's `timeout_keep_alive` begins at the end of an answer and ends with the next byte of any
kind. It doesn't count before the first request, and `limit_concurrency` counts whole requests. A
silent client, or one that sends a head (or an ignored body) byte by byte, would hold a socket for
good. Here a request's head must arrive within HEAD_S, counted from the start of the connection or
the end of the last answer. serve/lifetime.py limits the TLS handshake before it likewise.
"""

import asyncio

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from stereocell.serve.limits import HEAD_S


class HeadDeadline(H11Protocol):
    """uvicorn's HTTP protocol with a deadline for the head of each request."""

    head_s = HEAD_S
    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._await_head()

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._stop_if_answering()

    def on_response_complete(self) -> None:
        self._await_head()
        super().on_response_complete()  # this starts a request that has already arrived
        self._stop_if_answering()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self._stop()  # websockets have limits of their own, in serve/limits.py
        super().handle_websocket_upgrade(event)

    def _await_head(self) -> None:
        self._stop()
        self._deadline = self.loop.call_later(self.head_s, self._close_or_abort)

    def _stop_if_answering(self) -> None:
        if self.cycle is not None and not self.cycle.response_complete:
            self._stop()

    def _stop(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _close_or_abort(self) -> None:
        if self.transport.get_write_buffer_size():
            self.transport.close()  # the end of an answer is still being sent
        else:
            self.transport.abort()  # closing TLS properly would wait for the client again
