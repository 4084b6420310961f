"""Let only one command at a time write into an OUT on object storage.

On object storage no lock ends by itself. The holder writes the object again every BEAT_S seconds. A
command takes over a lock that is older than STALE_S, or whose process on this machine is gone. The
clocks of machine and storage may differ by minutes.

If the storage supports conditional writes (AWS since 2024), only one command can create the lock.
Elsewhere two commands that begin within a second may both succeed.
"""

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from typing import Any

from stereocell.model.errors import OutputError
from stereocell.storage.claim import describe, in_words
from stereocell.storage.processes import is_alive, machine

BEAT_S, STALE_S = 60.0, 600.0  # s between writes of the holder; s after which a lock is stale
_SETTLE_S = 1.0  # s to wait after a takeover, in case another command does the same


@contextmanager
def alone_at(fs: Any, path: str, shown: str, command: str) -> Iterator[Callable[[], None]]:
    """Hold an OUT on object storage.

    fs       file system of fsspec
    path     path of the lock in it
    shown    OUT's address, for messages
    command  the command, for the lock's content

    Yields a function that raises OutputError once another command holds the lock. A process that
    sleeps longer than STALE_S, for example on a suspended laptop, loses it. Raises OutputError if
    another process holds the lock (the text names it). Errors of the storage are not caught.
    """
    content = json.dumps(describe(command)).encode()
    _create(fs, path, shown, content)
    over = threading.Event()
    lost: list[str] = []
    renewed = time.time()

    def renew() -> None:
        nonlocal renewed
        with suppress(Exception):  # the next read or write reports a failure of the storage
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
        if not lost and time.time() - renewed > 2 * BEAT_S:  # the machine was suspended
            renew()
        if lost:
            raise OutputError(
                f"{shown}: {lost[0]} has taken over, because this command was silent for too long: "
                "start it again when the other command has ended"
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
            break  # the write succeeded, and only the storage's answer was lost
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
