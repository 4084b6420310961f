"""What a command may write as long as it is at work in OUT, and its workers for it.

A command's workers may outlive it, as a cluster's do: before they put anything in its place, they
look whether OUT's lock still says what it said when they were asked.
"""

import json
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import uuid4

from stereocell.model.errors import OutputError
from stereocell.storage.processes import machine, start_of

if sys.platform != "win32":
    pass

LOCK = ".lock"


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
def holding(claim: Claim) -> Iterator[None]:
    """Have a claim within the block, for the workers of a command."""
    before = _held.set(claim)
    try:
        yield
    finally:
        _held.reset(before)


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


def describe(command: str) -> dict[str, Any]:
    """Return what a lock says of the command that holds it, for people and for `Claim`."""
    return {
        "id": str(uuid4()),
        "process": os.getpid(),
        "start": start_of(os.getpid()),
        "machine": machine(),
        "host": socket.gethostname(),
        "command": command,
        "since": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def in_words(content: bytes) -> str:
    """Return the command that a lock's content names, in words."""
    try:
        owner = json.loads(content)
        return (
            f"`stereocell {owner['command']}` (process {owner['process']} on {owner['host']}, "
            f"since {owner['since']})"
        )
    except (ValueError, KeyError, TypeError):  # it has just begun
        return "another command"
