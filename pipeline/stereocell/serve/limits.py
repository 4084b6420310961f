"""What one client may ask for, and how it is told that it asked for too much.

All limits of the server stand here; docs/brick-stream.md has them for people. They are far above
what a browser that opens a large bundle does (six connections to a host, a request for each file),
and low enough that a client that means ill leaves memory and file descriptors to the others.
"""

import asyncio
from dataclasses import dataclass

# A websocket, /bricks
MESSAGE_BYTES = 1 << 16
WINDOW_BYTES = 1 << 20
FRAME_BYTES = 48 << 10  # below the smallest window
MAX_TREES = 1024
MAX_CONNECTIONS = 128
CLIENT_SOCKETS = 64  # of these, from one address
MESSAGES_PER_S = 100  # but for acks
ACKS_PER_S = 5000
CONTROLS_PER_S = 20  # pings and pongs
MAX_FRAGMENTS = 64  # frames of one message
FRAGMENTS_S = 10.0  # from a message's first frame to its last
HELLO_S = 10.0
ACK_S = 60.0
_REASON_BYTES = 120  # RFC 6455: a close frame has room for 123

# A request
TARGET_BYTES = 8 << 10
HEAD_BYTES = 16 << 10
MAX_HEADERS = 100
HEAD_S = 10.0  # for the head of an HTTP request, and before it the TLS handshake
STALL_S = 60.0  # in which some of an answer must go out
LINGER_S = 1.0  # in which a client that was refused may still send, so that it reads the answer

# A client, which is an address: all of this machine are one, as those behind one router
CONNECTIONS = 400  # of all clients: each may have a file open, and 1024 descriptors are usual
CLIENT_CONNECTIONS = 200
REQUESTS_PER_S = 500
REQUESTS_AT_ONCE = 20_000  # a bundle has thousands of files
_KNOWN = 1024  # addresses without a connection whose requests are remembered

STOP_S = 8.0  # for transfers that run when the server is stopped


class Refusal(Exception):
    """The connection is to be closed with this code and reason."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code = code
        self.reason = reason.encode()[:_REASON_BYTES].decode(errors="ignore")


class Bucket:
    """At most so many a second in the long run, `at_once` (or twice as many) at once."""

    def __init__(self, per_s: int, at_once: int | None = None) -> None:
        self.per_s = per_s
        self._most = float(2 * per_s if at_once is None else at_once)
        self._left = self._most
        self._last = asyncio.get_running_loop().time()

    def take(self) -> bool:
        """Return whether one more is allowed, and count it."""
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
        """Return whether a client may have one more connection, and count it."""
        client = self._find(address)
        if self.connections >= CONNECTIONS or client.connections >= CLIENT_CONNECTIONS:
            return False
        client.connections += 1
        self.connections += 1
        return True

    def leave(self, address: str) -> None:
        """Count a connection that entered, and ended, no more."""
        self._known[address].connections -= 1
        self.connections -= 1

    def ask(self, address: str) -> bool:
        """Return whether a client may make one more request, and count it."""
        return self._find(address).requests.take()

    def _find(self, address: str) -> _Client:
        client = self._known.get(address)
        if client is None:
            idle = [name for name, one in self._known.items() if not one.connections]
            for name in idle[: max(0, len(idle) - _KNOWN + 1)]:  # those known longest
                del self._known[name]
            client = _Client(Bucket(REQUESTS_PER_S, REQUESTS_AT_ONCE))
            self._known[address] = client
        return client
