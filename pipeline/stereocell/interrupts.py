"""Ctrl-C reaches every process of a terminal's group; only the command itself is to answer it."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker


@contextmanager
def children_ignore_interrupts() -> Iterator[None]:
    """Within, processes and threads are started that SIGINT doesn't reach: they inherit the mask.

    Without it each worker prints a traceback of its own. One that comes meanwhile is not lost: it
    is delivered at the end.
    """
    resource_tracker.ensure_running()  # when it starts, it unblocks SIGINT in our thread
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
