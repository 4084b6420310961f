"""How a command is stopped: by Ctrl-C, or by SIGTERM, as batch systems and Kubernetes do it.

Ctrl-C reaches every process of a terminal's group; only the command itself is to answer it.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker


class Terminated(KeyboardInterrupt):
    """SIGTERM, which stops a command as Ctrl-C does: locks and half-made files are taken away."""


@contextmanager
def answering_sigterm() -> Iterator[None]:
    """Within, SIGTERM raises Terminated. Only the main thread can ask for that."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _stop(*_: object) -> None:
    raise Terminated


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
