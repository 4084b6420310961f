"""The guard of all writers: nothing of somebody else is removed or replaced without --force.

A command may replace results of StereoCell of the same specimen. Other content at the place of a
result ends the command before it writes, with a line that names the content.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from stereocell.model.errors import OutputError
from stereocell.storage.contents import contents_of
from stereocell.storage.kinds import Kind

_forced: ContextVar[bool] = ContextVar("forced", default=False)
HINT = "choose another place, or --force replaces it"


@contextmanager
def forcing(is_forced: bool) -> Iterator[None]:
    """Within the block, allow that results replace whatever lies at their place (--force)."""
    before = _forced.set(is_forced)
    try:
        yield
    finally:
        _forced.reset(before)


def is_forced() -> bool:
    """Return whether --force is given."""
    return _forced.get()


def require_free(place: Path, *, expected: str, is_ours: bool = False, found: str = "") -> None:
    """Raise OutputError where a result would replace content that is not its own earlier result.

    expected  the allowed content, for the message
    is_ours   whether the caller has recognised an earlier result of the same specimen
    found     the content in words; empty: `contents_of` recognises it
    """
    if is_ours or is_forced():
        return
    there = contents_of(place)
    if there.kind is not Kind.NOTHING:
        raise refused(place, found or there.words, expected)


def refused(place: Path | str, found: str, expected: str) -> OutputError:
    """Return the error of a place that holds something else."""
    return OutputError(f"{place}: holds {found}, expected {expected}: {HINT}")
