"""Begin and end: what runs when the server is stopped may end in STOP_S, and nothing new begins.

uvicorn alone gives TLS a minute before the first byte, logs a fault and a traceback for what did
not end in time, and from Python 3.12 on waits for clients even after the second Ctrl+C.
"""

import asyncio
import socket
import ssl
from collections.abc import Callable
from functools import partial

import uvicorn

from stereocell.serve_limits import HEAD_S, STOP_S
from stereocell.serve_protocol import GuardedHttp, State

_TICK_S = 0.05


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
        """context: for TLS; on_wait: told how many transfers the end waits for."""
        super().__init__(config)
        self.server_state = State()
        self._context = context
        self._on_wait = on_wait

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await self.lifespan.startup()
        make = partial(GuardedHttp, self.config, self.server_state, self.lifespan.state)
        listen = asyncio.get_running_loop().create_server
        timeout = None if self._context is None else self.handshake_s
        self.servers = [
            await listen(make, sock=one, ssl=self._context, ssl_handshake_timeout=timeout)
            for one in sockets or []
        ]
        self.started = True

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        state, loop = self.server_state, asyncio.get_running_loop()
        for server in self.servers:
            server.close()
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
        if state.tasks:  # they hear that their clients left
            await asyncio.wait(state.tasks, timeout=1)
        await self.lifespan.shutdown()
