"""One command at a time writes into an OUT: who comes second is told who is at work there.

OUT/.lock is held by the system's own lock (flock), which ends with its process however that ends: a
stale file is taken over by itself, and no process id that has been given away again can mislead.
What the file says is for people alone. On NFS the lock holds between machines (Linux 2.6.12 on).

On object storage nothing ends by itself: the object is written anew every BEAT_S seconds, and one
that has not been for STALE_S, or whose process on this machine is gone, is taken over. The clocks
of machine and storage may differ by minutes. Only one can create it where the storage knows
conditional writes (AWS since 2024); elsewhere two that begin within a second may both get in.

A command's workers may outlive it, as a cluster's do: before they put anything in its place, they
look whether OUT's lock still says what it said when they were asked.
"""

import json
import os
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import uuid4

from stereocell.model.errors import OutputError
from stereocell.storage.processes import is_alive, machine, start_of

if sys.platform != "win32":
    import fcntl

LOCK = ".lock"
BEAT_S, STALE_S = 60.0, 600.0
_SETTLE_S = 1.0  # after taking over: another may have done so at once


@dataclass(frozen=True, slots=True)
class Claim:
    """What OUT/.lock says while one command is at work there: for its workers. Picklable."""

    file: Path
    content: bytes

    def require(self) -> None:
        """Raise OutputError once that command has ended."""
        with suppress(OSError):
            if self.file.read_bytes() == self.content:
                return
        raise has_ended(str(self.file.parent))


def has_ended(out: str) -> OutputError:
    return OutputError(f"{out}: the command that asked for this has ended")


_held: ContextVar[Claim | None] = ContextVar("held", default=None)
_worked_for: ContextVar[Claim | None] = ContextVar("worked_for", default=None)


def held() -> Claim | None:
    """Return the claim that this command has on the folder that it works in."""
    return _held.get()


@contextmanager
def working_for(claim: Claim) -> Iterator[None]:
    """Write within the block for the command that has this claim, and only as long as it has."""
    before = _worked_for.set(claim)
    try:
        yield
    finally:
        _worked_for.reset(before)


def require_asked() -> None:
    """Raise OutputError if this is work for a command that has ended."""
    claim = _worked_for.get()
    if claim is not None:
        claim.require()


@contextmanager
def alone_in(out: Path, command: str) -> Iterator[None]:
    """Hold OUT for a command that writes into it; a folder that stays empty is not left behind.

    If who held it before was killed, what that one had half written is removed.

    Raises OutputError if another process holds it, naming that one, or if OUT can't be written.
    """
    made = _missing_folders(out)
    try:
        try:
            out.mkdir(parents=True, exist_ok=True)
            file, was_killed = _hold(out / LOCK, command)
        except OSError as error:
            raise OutputError(
                f"{out}: can't be written ({error.strerror}), expected a folder of your own"
            ) from None
        try:
            if was_killed:
                from stereocell.storage.atomic_write import (
                    clear_remains,  # needs mirror, which needs this
                )

                clear_remains(out)
            before = _held.set(Claim((out / LOCK).absolute(), (out / LOCK).read_bytes()))
            try:
                yield
            finally:
                _held.reset(before)
        finally:
            with suppress(OSError):  # OUT can't be written any more: whoever comes takes it over
                (out / LOCK).unlink(missing_ok=True)  # while it is held: nobody waits at this file
            os.close(file)
    finally:
        for folder in made:
            with suppress(OSError):  # something lies in it
                folder.rmdir()


def _missing_folders(out: Path) -> list[Path]:
    """Return OUT and the folders above it that are not there, the innermost first."""
    return [folder for folder in (out, *out.parents) if not folder.exists()]


def _hold(path: Path, command: str) -> tuple[int, bool]:
    """Return the open lock, and whether who held it before was killed."""
    while True:
        file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            if sys.platform != "win32":
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            told = _owner(file)
            os.close(file)
            raise OutputError(
                f"{path.parent}: {told} is writing here: wait until it has ended"
            ) from None
        # whoever held it before may have removed the file in between
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file), path.stat()):
                break
        os.close(file)
    was_killed = os.fstat(file).st_size > 0
    with suppress(OSError):  # a full disk: what it says is for people
        os.ftruncate(file, 0)
        os.write(file, json.dumps(_claim(command)).encode())
    return file, was_killed


def _claim(command: str) -> dict[str, Any]:
    return {
        "id": str(uuid4()),
        "process": os.getpid(),
        "start": start_of(os.getpid()),
        "machine": machine(),
        "host": socket.gethostname(),
        "command": command,
        "since": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _owner(file: int) -> str:
    return _in_words(os.pread(file, 4096, 0))


def _in_words(content: bytes) -> str:
    try:
        owner = json.loads(content)
        return (
            f"`stereocell {owner['command']}` (process {owner['process']} on {owner['host']}, "
            f"since {owner['since']})"
        )
    except (ValueError, KeyError, TypeError):  # it has just begun
        return "another command"


@contextmanager
def alone_at(fs: Any, path: str, shown: str, command: str) -> Iterator[Callable[[], None]]:
    """Hold an OUT on object storage: `path` is the lock's in a file system of fsspec.

    Yields what raises OutputError once the lock is another's: who slept past STALE_S, as a laptop
    does, loses it. Raises OutputError if another process holds it, naming that one. What the
    storage itself raises is the caller's.
    """
    content = json.dumps(_claim(command)).encode()
    _create(fs, path, shown, content)
    over = threading.Event()
    lost: list[str] = []
    renewed = time.time()

    def renew() -> None:
        nonlocal renewed
        with suppress(Exception):  # a storage that fails now is met where it matters
            there = _read(fs, path)
            if there is not None and there[0] == content:
                fs.pipe_file(path, content)
                renewed = time.time()
            else:
                lost.append("another command" if there is None else _in_words(there[0]))

    def beat() -> None:
        while not lost and not over.wait(BEAT_S):
            renew()

    def require() -> None:
        if not lost and time.time() - renewed > 2 * BEAT_S:  # it has slept
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
            break  # it was put, and only the storage's answer to that was lost
        if there is not None:
            if not _is_stale(*there):
                raise OutputError(
                    f"{shown}: {_in_words(there[0])} is writing here: wait until it has ended"
                )
            with suppress(FileNotFoundError):
                fs.rm_file(path)
            taken_over = True
    if taken_over:
        time.sleep(_SETTLE_S)
    there = _read(fs, path)
    if there is None or there[0] != content:
        told = "another command" if there is None else _in_words(there[0])
        raise OutputError(f"{shown}: {told} is writing here: wait until it has ended")


def _read(fs: Any, path: str) -> tuple[bytes, float] | None:
    """Return a lock's content and how many seconds ago it was written; None: there is none."""
    try:
        content, written = fs.cat_file(path), fs.modified(path)
    except FileNotFoundError:
        return None
    return content, (datetime.now(UTC) - written).total_seconds()


def _is_stale(content: bytes, age_s: float) -> bool:
    with suppress(ValueError, KeyError, TypeError):
        owner = json.loads(content)
        if owner["machine"] == machine():
            return not is_alive(int(owner["process"]), owner.get("start", "")) or age_s > STALE_S
    return age_s > STALE_S
