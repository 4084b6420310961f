"""Keep warnings and log lines of libraries from the user's terminal.

A library warns of things that a user can't change, such as a field of another version, or that a
reader reports in a sentence of its own. So its warnings are not shown while it reads. Warnings of
StereoCell's own code are shown, because they are bugs.

Log lines reach the handlers that a program has set up. Lines without a handler would be printed by
Python's "last resort" handler, which is replaced inside the block.
"""

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

_LIBRARIES = r"(?!stereocell(\.|$))"  # matches the names of all modules outside of this package
_lock = Lock()
_depth = 0  # number of blocks that threads are inside of
_saved: tuple[Any, logging.Handler | None] | None = None  # warning filters and last-resort handler


@contextmanager
def quiet_libraries() -> Iterator[None]:
    """Hide warnings and log lines of libraries while any thread is inside such a block.

    Both settings of Python are shared by all threads. The first thread that enters changes them,
    and the last one that leaves restores them.
    """
    global _depth
    with _lock:
        if _depth == 0:
            _begin()
        _depth += 1
    try:
        yield
    finally:
        with _lock:
            _depth -= 1
            if _depth == 0:
                _end()


def _begin() -> None:
    global _saved
    caught = warnings.catch_warnings()
    _saved = caught, logging.lastResort
    caught.__enter__()
    warnings.filterwarnings("ignore", module=_LIBRARIES)
    logging.lastResort = logging.NullHandler()


def _end() -> None:
    global _saved
    assert _saved is not None
    caught, logging.lastResort = _saved
    caught.__exit__(None, None, None)
    _saved = None
