"""Start and stop the server. At the stop, running transfers may finish within STOP_S; none begins.

This class replaces three behaviours of uvicorn. It gives TLS a minute before the first byte.
It logs an error and a traceback for transfers that didn't finish in time. From Python 3.12 on, it
waits for clients even after the second Ctrl+C. In asyncio, a TLS connection counts only after its
handshake, so that many silent clients would use up all file descriptors of this process.
"""

import asyncio
import errno
import signal
import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import uvicorn

from stereocell.serve.http_protocol import GuardedHttp, State
from stereocell.serve.limits import HEAD_S, STOP_S

_TICK_S = 0.05  # s between two checks of the running transfers


class Lifetime(uvicorn.Server):
    """uvicorn's server on one bound socket."""

    handshake_s = HEAD_S
    stop_s = STOP_S

    def __init__(
        self,
        config: uvicorn.Config,
        context: ssl.SSLContext | None,
        on_wait: Callable[[int], None],
    ) -> None:
        """Configure a server.

        context  TLS context; None for plain HTTP
        on_wait  called at the stop with the number of transfers that may still finish
        """
        super().__init__(config)
        self.server_state = state = State()
        self._clients = state.clients
        self._context = context
        self._on_wait = on_wait
        self._handshakes: set[asyncio.Task[None]] = set()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to accept connections on bound sockets, with TLS if the server has a context."""
        await self.lifespan.startup()
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(_report_fault)
        make: Callable[[], asyncio.Protocol] = self._make_http
        if self._context is not None:
            make = partial(_BeforeTls, self._start_tls)
        self.servers = [await loop.create_server(make, sock=one) for one in sockets or []]
        self.started = True

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Handle SIGTERM, and SIGINT unless it was ignored, as shells do for background jobs."""
        is_ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        with super().capture_signals():
            if is_ignored and threading.current_thread() is threading.main_thread():
                signal.signal(signal.SIGINT, signal.SIG_IGN)
            yield

    def _make_http(self) -> GuardedHttp:
        kind = self.config.http_protocol_class
        assert issubclass(kind, GuardedHttp)
        return kind(self.config, self.server_state, self.lifespan.state)

    def _start_tls(self, transport: asyncio.Transport) -> None:
        """Begin TLS on a new connection, and count it among its client's."""
        address = str((transport.get_extra_info("peername") or ("",))[0])
        if not self._clients.enter(address):
            transport.abort()
            return

        async def shake_hands() -> None:
            early = _EarlyBytes()
            try:
                secure = await asyncio.get_running_loop().start_tls(
                    transport,
                    early,
                    self._context,  # type: ignore[arg-type]
                    server_side=True,
                    ssl_handshake_timeout=self.handshake_s,
                )
            except OSError:  # the client doesn't speak TLS, or is too slow
                return transport.abort()
            finally:
                self._clients.leave(address)
            if secure is not None and not early.is_over:
                http = self._make_http()
                secure.set_protocol(http)
                http.connection_made(secure)
                if early.data:  # uvicorn takes a call without data for the end of the connection
                    http.data_received(early.data)

        task = asyncio.ensure_future(shake_hands())
        self._handshakes.add(task)
        task.add_done_callback(self._handshakes.discard)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Close the sockets; let running transfers finish within `stop_s`."""
        state, loop = self.server_state, asyncio.get_running_loop()
        for server in self.servers:
            server.close()
        for handshake in self._handshakes:
            handshake.cancel()
        for connection in list(state.connections):
            connection.shutdown()
        end = loop.time() + self.stop_s
        await asyncio.sleep(2 * _TICK_S)
        transfers = sum(isinstance(one, GuardedHttp) for one in state.connections)
        if transfers and not self.force_exit:
            self._on_wait(transfers)
        while (state.connections or state.tasks) and not self.force_exit and loop.time() < end:
            await asyncio.sleep(_TICK_S)
        for connection in list(state.connections):
            connection.transport.abort()
        if state.tasks:  # the requests' tasks receive the news that their clients left
            await asyncio.wait(state.tasks, timeout=1)
        await self.lifespan.shutdown()


class _BeforeTls(asyncio.Protocol):
    """A new connection to a server with TLS. It begins the TLS handshake."""

    def __init__(self, start_tls: Callable[[asyncio.Transport], None]) -> None:
        self._start_tls = start_tls

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._start_tls(transport)


class _EarlyBytes(asyncio.Protocol):
    """Buffers the bytes that arrive between the end of a handshake and the server's HTTP."""

    def __init__(self) -> None:
        self.data = b""
        self.is_over = False

    def data_received(self, data: bytes) -> None:
        self.data += data

    def connection_lost(self, exc: Exception | None) -> None:
        self.is_over = True


def _report_fault(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Log a fault, unless file descriptors ran out: asyncio would log that at each new attempt."""
    fault = context.get("exception")
    if not isinstance(fault, OSError) or fault.errno not in (errno.EMFILE, errno.ENFILE):
        loop.default_exception_handler(context)
