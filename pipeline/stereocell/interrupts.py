"""Ctrl-C reaches every process of a terminal's group; only the command itself is to answer it."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def children_ignore_interrupts() -> Iterator[None]:
    """Within, processes are started that ignore SIGINT: they inherit it, and Python leaves it so.

    Without it each worker prints a traceback of its own. Elsewhere than in the main thread, where
    signals can't be set, nothing is changed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
