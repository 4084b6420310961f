"""What one client of `/bricks` may ask for, and how it is told that it asked for too much."""

import asyncio

MESSAGE_BYTES = 1 << 16
WINDOW_BYTES = 1 << 20
FRAME_BYTES = 48 << 10  # below the smallest window
MAX_TREES = 1024
MAX_CONNECTIONS = 128
MESSAGES_PER_S = 100  # but for acks
ACKS_PER_S = 5000
HEAD_S = 10.0  # for the head of an HTTP request
HELLO_S = 10.0
ACK_S = 60.0
_REASON_BYTES = 120  # RFC 6455: a close frame has room for 123


class Refusal(Exception):
    """The connection is to be closed with this code and reason."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code = code
        self.reason = reason.encode()[:_REASON_BYTES].decode(errors="ignore")


class Bucket:
    """At most so many a second in the long run, twice as many at once."""

    def __init__(self, per_s: int) -> None:
        self.per_s = per_s
        self._left = 2.0 * per_s
        self._last = asyncio.get_running_loop().time()

    def take(self) -> bool:
        """Return whether one more is allowed, and count it."""
        now = asyncio.get_running_loop().time()
        self._left = min(2.0 * self.per_s, self._left + (now - self._last) * self.per_s)
        self._last = now
        self._left -= 1
        return self._left >= 0
