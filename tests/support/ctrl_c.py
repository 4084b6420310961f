"""Ctrl+C in tests. Shells have SIGINT ignored in what they start in the background.

Such a program leaves it ignored, and so do those that it starts, Python and ours among them.
"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def heeded() -> Iterator[None]:
    """Within, SIGINT interrupts this process and those that it starts, wherever it was started."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def ignored() -> Iterator[None]:
    """Within, processes are started as in the background of a shell."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
