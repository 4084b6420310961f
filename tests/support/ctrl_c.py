"""Ctrl+C in tests. Shells make programs that they start in the background ignore SIGINT.

A program that starts with SIGINT ignored keeps ignoring it, and so do the programs that it starts.
Python and StereoCell behave like this, too.
"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def heeded() -> Iterator[None]:
    """Let SIGINT interrupt this process and its children, even if it runs in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def ignored() -> Iterator[None]:
    """Start processes as a shell starts them in the background: they ignore SIGINT."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
