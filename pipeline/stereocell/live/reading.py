"""Report the share of a source that has been read for its first view, on terminal and page."""

import time
from collections.abc import Callable
from threading import Lock

_EACH_S = 3.0  # s between two lines in the terminal, and before the first line


class Reading:
    """Adds up the share that has been read. Any thread may call these methods."""

    def __init__(self, print_line: Callable[[str], None]) -> None:
        """print_line: called with a line for a person from time to time."""
        self._print, self._adding = print_line, Lock()
        self._printed_s = time.monotonic()
        self.share = 0.0  # share of the source that has been read, 0..1

    def add(self, share: float) -> None:
        """Add a share, 0..1, of the source that has been read."""
        with self._adding:
            self.share = min(1.0, self.share + share)
            now_s = time.monotonic()
            if now_s - self._printed_s < _EACH_S:
                return
            self._printed_s = now_s
        self._print(f"reading the source: {self.share:.0%}")
