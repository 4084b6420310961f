"""Stop a command by Ctrl-C, or by SIGTERM, which batch systems and Kubernetes send.

Ctrl-C reaches every process that a terminal started, but only the command itself must react to it.
"""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager


class Terminated(KeyboardInterrupt):
    """SIGTERM has arrived. It stops a command like Ctrl-C: locks and partial files are removed."""


@contextmanager
def answering_sigterm() -> Iterator[None]:
    """Inside the block, raise Terminated on SIGTERM. It has no effect outside the main thread."""
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
    arrived: list[int] = []
    before = {}
    if threading.current_thread() is threading.main_thread():  # no other thread can set handlers
        for number in (signal.SIGINT, signal.SIGTERM):
            if callable(signal.getsignal(number)):  # ignored and default signals stay as they are
                before[number] = signal.signal(number, lambda found, _: arrived.append(found))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if arrived:
            signal.raise_signal(arrived[-1])


@contextmanager
def children_ignore_interrupts() -> Iterator[None]:
    """Let processes and threads that are started inside the block ignore SIGINT (Ctrl-C).

    Without it each worker prints a traceback of its own. A SIGINT inside the block is delivered at
    its end. Windows has no signal mask to inherit, so there the workers do print tracebacks.
    """
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # started before, because it unblocks SIGINT in this thread
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
