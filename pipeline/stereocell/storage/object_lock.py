"""One command at a time writes into an OUT on object storage.

On object storage no lock ends by itself. The holder writes the object anew every BEAT_S seconds; a
command takes over a lock that is older than STALE_S, or whose process on this machine is gone. The
clocks of machine and storage may differ by minutes. Where the storage supports conditional writes
(AWS since 2024), only one command can create the lock; elsewhere two that begin within a second may
both succeed.
"""

import json
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from typing import Any

from stereocell.model.errors import OutputError
from stereocell.storage.processes import is_alive, machine

if sys.platform != "win32":
    pass
from stereocell.storage.claim import describe, in_words

BEAT_S, STALE_S = 60.0, 600.0  # s between writes; age in s at which a lock is stale
_SETTLE_S = 1.0  # s to wait after a takeover: another command may have done the same


@contextmanager
def alone_at(fs: Any, path: str, shown: str, command: str) -> Iterator[Callable[[], None]]:
    """Hold an OUT on object storage; `path` is the lock's path in a file system of fsspec.

    Yields a function that raises OutputError once another command holds the lock: a process that
    sleeps longer than STALE_S, as on a suspended laptop, loses it. Raises OutputError where another
    process holds it (the text names it). Errors of the storage pass through.
    """
    content = json.dumps(describe(command)).encode()
    _create(fs, path, shown, content)
    over = threading.Event()
    lost: list[str] = []
    renewed = time.time()

    def renew() -> None:
        nonlocal renewed
        with suppress(Exception):  # a failure of the storage is reported at the next read or write
            there = _read(fs, path)
            if there is not None and there[0] == content:
                fs.pipe_file(path, content)
                renewed = time.time()
            else:
                lost.append("another command" if there is None else in_words(there[0]))

    def beat() -> None:
        while not lost and not over.wait(BEAT_S):
            renew()

    def require() -> None:
        if not lost and time.time() - renewed > 2 * BEAT_S:  # the process has slept
            renew()
        if lost:
            raise OutputError(
                f"{shown}: was taken over by {lost[0]}, as this command had not been heard of for "
                "long: start it again when that one has ended"
            )

    thread = threading.Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield require
    finally:
        over.set()
        thread.join()
        with suppress(Exception):
            if fs.cat_file(path) == content:
                fs.rm_file(path)


def _create(fs: Any, path: str, shown: str, content: bytes) -> None:
    taken_over = False
    while True:
        there = _read(fs, path)
        if there is None:
            with suppress(FileExistsError):
                fs.pipe_file(path, content, mode="create")
                break
            there = _read(fs, path)
        if there is not None and there[0] == content:
            break  # the write succeeded, only the storage's answer was lost
        if there is not None:
            if not _is_stale(*there):
                raise OutputError(
                    f"{shown}: {in_words(there[0])} is writing here: wait until it has ended"
                )
            with suppress(FileNotFoundError):
                fs.rm_file(path)
            taken_over = True
    if taken_over:
        time.sleep(_SETTLE_S)
    there = _read(fs, path)
    if there is None or there[0] != content:
        owner = "another command" if there is None else in_words(there[0])
        raise OutputError(f"{shown}: {owner} is writing here: wait until it has ended")


def _read(fs: Any, path: str) -> tuple[bytes, float] | None:
    """Return a lock's content and its age in seconds; None: there is none."""
    try:
        content, written = fs.cat_file(path), fs.modified(path)
    except FileNotFoundError:
        return None
    return content, (datetime.now(UTC) - written).total_seconds()


def _is_stale(content: bytes, age_s: float) -> bool:
    with suppress(ValueError, KeyError, TypeError):
        owner = json.loads(content)
        if owner["machine"] == machine():
            return (
                not is_alive(int(owner["process"]), start=owner.get("start", "")) or age_s > STALE_S
            )
    return age_s > STALE_S
