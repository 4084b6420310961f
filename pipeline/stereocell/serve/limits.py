"""All limits of one client, and how the server refuses a client that exceeds them.

docs/server.md lists the limits for users. They are far above the needs of a browser that opens a
large bundle (six connections to a host, a request for each file). They are low enough that a
malicious client can't take all memory or file descriptors from the others.
"""

import asyncio
from dataclasses import dataclass

# A websocket, /bricks
MESSAGE_BYTES = 1 << 16  # bytes, longest message of a client
WINDOW_BYTES = 1 << 20  # largest window, bytes
FRAME_BYTES = 48 << 10  # bytes, largest frame; smaller than the smallest window
MAX_TREES = 1024  # most trees that a connection may open
MAX_CONNECTIONS = 128  # most websockets of all clients together
CLIENT_SOCKETS = 64  # most websockets of one address
MESSAGES_PER_S = 100  # most messages a second, without acks
ACKS_PER_S = 5000  # most acks a second on a connection
CONTROLS_PER_S = 20  # most pings, and most pongs, a second
MAX_FRAGMENTS = 64  # most frames of one message
FRAGMENTS_S = 10.0  # s from a message's first frame to its last
HELLO_S = 10.0  # s from the connection to its `hello`
ACK_S = 60.0  # s from a full window to the next ack
_REASON_BYTES = 120  # RFC 6455: a close frame has room for 123

# A request
TARGET_BYTES = 8 << 10  # bytes, longest path with its query
HEAD_BYTES = 16 << 10  # bytes, largest head
MAX_HEADERS = 100  # most headers of a request
HEAD_S = 10.0  # s for the head of a request, and another HEAD_S for the TLS handshake before it
STALL_S = 60.0  # s, longest time in which a client reads no byte of its answer
LINGER_S = 1.0  # s in which a refused client may go on sending, so that it can read the refusal

# Bodies of requests to an inbox
LIST_BYTES = 16 << 20  # bytes, longest list of files that announces an upload
SMALL_BYTES = 64 << 10  # bytes, largest body of any other request with JSON
BODY_STALL_S = 30.0  # s, longest time without a byte of a body
BODY_S = 300.0  # s, longest time for a whole body

# A client is identified by its address. All clients behind one router count as one.
CONNECTIONS = 400  # most sockets of all clients; each may open a file, of 1024 descriptors in all
CLIENT_CONNECTIONS = 200  # most connections of one client
REQUESTS_PER_S = 500  # most requests a second of one client, in the long run
REQUESTS_AT_ONCE = 20_000  # most requests of one client in a burst; bundles have thousands of files
_KNOWN = 1024  # most addresses without a connection whose requests are remembered

STOP_S = 8.0  # s in which transfers may finish that run when the server is stopped


class Refusal(Exception):
    """Raised to close a websocket with this code and reason."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code = code
        self.reason = reason.encode()[:_REASON_BYTES].decode(errors="ignore")


class Bucket:
    """A token bucket: allows `per_s` a second in the long run, `at_once` in a burst.

    The default of `at_once` is 2 * per_s.
    """

    def __init__(self, per_s: int, at_once: int | None = None) -> None:
        self.per_s = per_s
        self._most = float(2 * per_s if at_once is None else at_once)
        self._left = self._most
        self._last = asyncio.get_running_loop().time()

    def take(self) -> bool:
        """Return whether one more is allowed; count it if so."""
        now = asyncio.get_running_loop().time()
        self._left = min(self._most, self._left + (now - self._last) * self.per_s)
        self._last = now
        if self._left < 1:
            return False
        self._left -= 1
        return True


@dataclass(slots=True)
class _Client:
    requests: Bucket
    connections: int = 0


class Clients:
    """The connections and requests of each client, by its address."""

    def __init__(self) -> None:
        self._known: dict[str, _Client] = {}
        self.connections = 0

    def enter(self, address: str) -> bool:
        """Return whether a client may have one more connection; count it if so."""
        client = self._find(address)
        if self.connections >= CONNECTIONS or client.connections >= CLIENT_CONNECTIONS:
            return False
        client.connections += 1
        self.connections += 1
        return True

    def leave(self, address: str) -> None:
        """Take a connection that `enter` has counted from the count."""
        self._known[address].connections -= 1
        self.connections -= 1

    def ask(self, address: str) -> bool:
        """Return whether a client may make one more request; count it if so."""
        return self._find(address).requests.take()

    def _find(self, address: str) -> _Client:
        client = self._known.get(address)
        if client is None:
            idle = [name for name, one in self._known.items() if not one.connections]
            for name in idle[: max(0, len(idle) - _KNOWN + 1)]:  # the oldest come first
                del self._known[name]
            client = _Client(Bucket(REQUESTS_PER_S, REQUESTS_AT_ONCE))
            self._known[address] = client
        return client
