"""The claim of a command on OUT: the command and its workers may write while the command runs.

Workers of a cluster may outlive their command. Before they put a result in its place, they check
that the content of OUT's lock has not changed since the command sent them the task.
"""

import json
import os
import socket
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

LOCK = ".lock"


@dataclass(frozen=True, slots=True)
class Claim:
    """The content of OUT/.lock while a command works there, for its workers. Picklable."""

    file: Path
    content: bytes

    def require(self) -> None:
        """Raise OutputError if the command has ended, so that OUT/.lock has changed or is gone."""
        with suppress(OSError):
            if self.file.read_bytes() == self.content:
                return
        raise has_ended(str(self.file.parent))


def has_ended(out: str) -> OutputError:
    """Return the error of a task whose command has ended."""
    return OutputError(f"{out}: the command that sent this task has ended")


_held: ContextVar[Claim | None] = ContextVar("held", default=None)
_worked_for: ContextVar[Claim | None] = ContextVar("worked_for", default=None)


def held() -> Claim | None:
    """Return the claim of this command on its folder; None: it has none."""
    return _held.get()


@contextmanager
def holding(claim: Claim) -> Iterator[None]:
    """Within the block, set this command's claim for its workers."""
    before = _held.set(claim)
    try:
        yield
    finally:
        _held.reset(before)


@contextmanager
def working_for(claim: Claim) -> Iterator[None]:
    """Within the block, allow writing only while the command with this claim runs."""
    before = _worked_for.set(claim)
    try:
        yield
    finally:
        _worked_for.reset(before)


def require_asked() -> None:
    """Raise OutputError if this process works for a command that has ended."""
    claim = _worked_for.get()
    if claim is not None:
        claim.require()


def describe(command: str) -> dict[str, Any]:
    """Return the content of a lock, which describes the command that holds it."""
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
    """Return words for the command that a lock describes."""
    try:
        owner = json.loads(content)
        return (
            f"`stereocell {owner['command']}` (process {owner['process']} on {owner['host']}, "
            f"since {owner['since']})"
        )
    except (ValueError, KeyError, TypeError):  # the command has not written its description yet
        return "another command"
