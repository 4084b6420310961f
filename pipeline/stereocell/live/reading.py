"""How much of a source has been read for its first view: for the terminal and for the page."""

import time
from collections.abc import Callable
from threading import Lock

_EACH_S = 3.0  # s between two lines in the terminal: the first comes only where it takes longer


class Reading:
    """Counts what is read. Its methods may be called from any thread."""

    def __init__(self, print_line: Callable[[str], None]) -> None:
        """print_line: is given a line for a person from time to time."""
        self._print, self._adding = print_line, Lock()
        self._said_s = time.monotonic()
        self.share = 0.0  # 0..1

    def add(self, share: float) -> None:
        """Count a part, 0..1, that has been read."""
        with self._adding:
            self.share = min(1.0, self.share + share)
            now_s = time.monotonic()
            if now_s - self._said_s < _EACH_S:
                return
            self._said_s = now_s
        self._print(f"reading the source: {self.share:.0%}")
