"""Warnings and log lines of libraries, which are kept from the user's terminal.

A library warns of things that a user can't change, as a field of another version, or that a reader
says in a sentence of its own. So none of its warnings is shown while it reads. Warnings of our own
code stay: they are bugs. Log lines reach the handlers that a program has set up, but not Python's
last resort, which prints those of libraries that have no handler.
"""

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

_LIBRARIES = r"(?!stereocell(\.|$))"  # modules whose names begin otherwise
_lock = Lock()
_depth = 0
_saved: tuple[Any, logging.Handler | None] | None = None  # filters, and the last resort


@contextmanager
def quiet_libraries() -> Iterator[None]:
    """Show no warning and no log line of a library while a thread is inside such a block.

    Python keeps both settings once for all threads, so the first one changes them, and the last one
    restores them.
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
