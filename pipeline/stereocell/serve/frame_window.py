"""The frames on their way to one client: their bytes never exceed the client's window.

A frame counts from when it is sent until the client acknowledges it, or a later one.
"""

import asyncio
from collections import deque

from stereocell.serve.limits import ACK_S, WINDOW_BYTES, Refusal


class FrameWindow:
    """Counts the frames and bytes that the client has not acknowledged yet.

    size      most bytes without an acknowledgement
    sequence  number of the last frame that was sent; 0 before the first one
    """

    def __init__(self) -> None:
        self.size = WINDOW_BYTES
        self.sequence = 0
        self._unacknowledged: deque[tuple[int, int]] = deque()  # (sequence, bytes)
        self._unacknowledged_bytes = 0
        self._acked = asyncio.Event()

    def acknowledge(self, sequence: int) -> None:
        """Count all frames up to a number as received. Raises Refusal if it was never sent."""
        if sequence > self.sequence:
            raise Refusal(1008, f"ack of frame {sequence}, the last one was {self.sequence}")
        while self._unacknowledged and self._unacknowledged[0][0] <= sequence:
            self._unacknowledged_bytes -= self._unacknowledged.popleft()[1]
        self._acked.set()

    async def wait_for_room(self, length: int) -> None:
        """Wait until a frame of `length` bytes fits. Raises Refusal after ACK_S without an ack."""
        while self._unacknowledged_bytes + length > self.size:
            self._acked.clear()
            try:
                async with asyncio.timeout(ACK_S):
                    await self._acked.wait()
            except TimeoutError:
                raise Refusal(1008, f"no ack within {ACK_S:g} s") from None

    def add(self, length: int) -> None:
        """Count a frame of `length` bytes as sent, under the next number."""
        self.sequence += 1
        self._unacknowledged.append((self.sequence, length))
        self._unacknowledged_bytes += length
