"""The websocket over which a page watches a build; see serve/live_app.py."""

import asyncio
import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, replace
from functools import partial
from ipaddress import ip_address

from starlette.types import Scope
from starlette.websockets import WebSocket, WebSocketDisconnect

from stereocell.live.build_state import COMMANDS, LATE, State, WatchedBuild
from stereocell.serve.limits import CLIENT_SOCKETS, MAX_CONNECTIONS

_STATE_EVERY_S = 0.25  # s between two checks for a new state
MayControl = Callable[[Scope], bool]  # whether a client may pause, continue and cancel


class LiveSocket:
    """Talks to the pages that watch builds, and limits their number."""

    def __init__(self, may_control: MayControl) -> None:
        self._may_control = may_control
        self._sockets = 0

    async def refuse(self, socket: WebSocket) -> None:
        """Report to one client that the item was deleted, and close."""
        await socket.accept()
        await socket.send_text(_message(State(doing="deleted"), may_control=False))
        await socket.close()

    async def talk(self, socket: WebSocket, build: WatchedBuild) -> None:
        """Send one client each new state until it leaves; carry out its commands."""
        await socket.accept()
        if self._sockets >= min(MAX_CONNECTIONS, 4 * CLIENT_SOCKETS):
            await socket.close(1013, "too many connections are open, try again later")
            return
        self._sockets += 1
        may_control = self._may_control(socket.scope)
        received = asyncio.ensure_future(socket.receive_text())
        sent = ""
        try:
            while True:
                state = await asyncio.to_thread(lambda: build.state)
                text = _message(state, may_control=may_control)
                if text != sent:
                    await socket.send_text(text)
                    sent = text
                if state.doing == "deleted":
                    await socket.close()
                    return
                await asyncio.wait([received], timeout=_STATE_EVERY_S)
                if not received.done():
                    continue
                command = received.result()
                known = next((one for one in COMMANDS if one == command), None)
                if (known is None and command != LATE) or not may_control:
                    reason = "expected pause, continue, cancel or late, from a client with control"
                    await socket.close(1008, reason)
                    return
                await asyncio.to_thread(build.rest if known is None else partial(build.do, known))
                received = asyncio.ensure_future(socket.receive_text())
        except (WebSocketDisconnect, KeyError, RuntimeError):  # the client left, or sent bytes
            pass
        finally:
            self._sockets -= 1
            received.cancel()


def is_on_this_machine(scope: Scope) -> bool:
    """Return whether a client is on this machine."""
    with suppress(ValueError):
        client = scope.get("client")
        return client is not None and ip_address(client[0]).is_loopback
    return False


def _message(state: State, *, may_control: bool) -> str:
    """Return a state as JSON. Only a client that may control the build gets an error's line."""
    shown = state if may_control else replace(state, line="")
    return json.dumps({**asdict(shown), "may_control": may_control})
