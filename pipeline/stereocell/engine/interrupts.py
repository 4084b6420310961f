"""Stop a command by Ctrl-C, or by SIGTERM, which batch systems and Kubernetes send.

Ctrl-C reaches every process of a terminal's group; only the command itself must react to it.
"""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager


class Terminated(KeyboardInterrupt):
    """SIGTERM; it stops a command as Ctrl-C does: locks and half-written files are removed."""


@contextmanager
def answering_sigterm() -> Iterator[None]:
    """Raise Terminated on SIGTERM inside the block; without effect outside the main thread."""
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
def interrupts_put_off() -> Iterator[None]:
    """Delay Ctrl-C and SIGTERM until the end of the block, which must be short and end by itself.

    The last signal that arrived is raised at the end.
    """
    came: list[int] = []
    before = {}
    if threading.current_thread() is threading.main_thread():  # only it can set handlers
        for number in (signal.SIGINT, signal.SIGTERM):
            if callable(signal.getsignal(number)):  # neither ignored nor the system's default
                before[number] = signal.signal(number, lambda found, _: came.append(found))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if came:
            signal.raise_signal(came[-1])


@contextmanager
def children_ignore_interrupts() -> Iterator[None]:
    """Inside the block, start processes and threads that SIGINT doesn't reach (inherited mask).

    Without it each worker prints a traceback of its own. A SIGINT inside the block is not lost: it
    is delivered at the end. Windows has no such mask: there each worker prints its own.
    """
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # its start unblocks SIGINT in our thread
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
