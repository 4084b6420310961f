"""Let a build rest for moments while somebody waits for a frame on the same machine.

A lower priority is not enough. Linux first divides the cores between sessions, and a desktop
between its programs; priorities only count within each of them.
"""

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import psutil

REST_S = 0.5  # s that a rest continues after the last request for it
MOST_S = 2.0  # s, longest rest; the build then works for at least as long as it rested


def lead_group() -> None:
    """Make this process the leader of a process group with its later children.

    If the parent is killed during a rest, the system wakes the whole stopped group and ends it.
    """
    if sys.platform != "win32":
        os.setpgid(0, 0)


class Rests:
    """The rests of one process and its children. Any thread may call these methods."""

    def __init__(self, process: int) -> None:
        """process: the process's number (PID)."""
        self._process = psutil.Process(process)
        self._changed = threading.Lock()
        self._is_over = threading.Event()
        self._thread: threading.Thread | None = None
        self._waiting = 0
        self._until_s = self._not_before_s = 0.0
        self.rested_s = 0.0  # s, sum of all rests that have ended

    def ask(self) -> None:
        """Let the process rest for REST_S from now, unless it has just rested for MOST_S."""
        now_s = time.monotonic()
        with self._changed:
            self._until_s = now_s + REST_S
            self._begin(now_s)

    @contextmanager
    def while_someone_waits(self) -> Iterator[None]:
        """Let the process rest in the `with` block; in a long block it works half the time."""
        with self._changed:
            self._waiting += 1
            self._begin(time.monotonic())
        try:
            yield
        finally:
            with self._changed:
                self._waiting -= 1

    def end(self) -> None:
        """Let the process work without any more rests."""
        self._is_over.set()
        with self._changed:
            thread = self._thread
        if thread is not None:
            thread.join()

    def _begin(self, now_s: float) -> None:
        if self._is_over.is_set() or self._thread is not None or now_s < self._not_before_s:
            return
        self._thread = threading.Thread(target=self._rest, daemon=True)
        self._thread.start()

    def _rest(self) -> None:
        began_s = time.monotonic()
        _stop(self._process)
        try:
            while self._is_asked(time.monotonic()) and time.monotonic() < began_s + MOST_S:
                if self._is_over.wait(0.05):
                    break
        finally:
            _continue(self._process)
            with self._changed:
                now_s = time.monotonic()
                self.rested_s += now_s - began_s
                self._not_before_s = now_s + (now_s - began_s)
                self._thread = None

    def _is_asked(self, now_s: float) -> bool:
        return self._waiting > 0 or now_s < self._until_s


def _tree_of(process: psutil.Process) -> Iterator[psutil.Process]:
    """Yield a process, and then the children that it has when the caller asks for them."""
    yield process
    with suppress(psutil.Error):  # the process has ended
        yield from process.children(recursive=True)


def _stop(process: psutil.Process) -> None:
    # The parent is stopped before its children are listed, so that it can't start more of them.
    for one in _tree_of(process):
        with suppress(psutil.Error):
            one.suspend()


def _continue(process: psutil.Process) -> None:
    for one in _tree_of(process):
        with suppress(psutil.Error):
            one.resume()
