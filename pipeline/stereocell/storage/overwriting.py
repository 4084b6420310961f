"""The guard of all writers: nothing of somebody else is removed or replaced unless it is forced.

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

AT_A_PROMPT, IN_PYTHON = "--force", "force=True"
_forced: ContextVar[bool] = ContextVar("forced", default=False)
_force_words: ContextVar[str] = ContextVar("force_words", default="")  # empty: there is no way


@contextmanager
def forcing(is_forced: bool, words: str = "") -> Iterator[None]:
    """Within the block, allow that results replace whatever lies at their place, if it is forced.

    words  the caller's way to force it, for remedies: AT_A_PROMPT or IN_PYTHON; empty: none
    """
    before, words_before = _forced.set(is_forced), _force_words.set(words)
    try:
        yield
    finally:
        _forced.reset(before)
        _force_words.reset(words_before)


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
    return OutputError(
        f"{place}: holds {found}, expected {expected}: {or_force('choose another place')}"
    )


def or_force(remedy: str) -> str:
    """Return a remedy, followed by the caller's way to replace what is there, if it has one."""
    words = _force_words.get()
    return f"{remedy}, or {words} replaces it" if words else remedy
