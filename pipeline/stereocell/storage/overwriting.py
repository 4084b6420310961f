"""Keep commands from replacing files that are not StereoCell's results, except with --force.

A command may replace StereoCell's results of the same specimen. If it finds anything else at the
place of a result, it stops before it writes, with a line that names the content.
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
_force_words: ContextVar[str] = ContextVar("force_words", default="")  # empty: no way to force


@contextmanager
def forcing(is_forced: bool, words: str = "") -> Iterator[None]:
    """Within the block, allow results to replace any content at their place, if it is forced.

    words  how the caller can force it, for messages: AT_A_PROMPT or IN_PYTHON; empty: not at all
    """
    before, words_before = _forced.set(is_forced), _force_words.set(words)
    try:
        yield
    finally:
        _forced.reset(before)
        _force_words.reset(words_before)


def is_forced() -> bool:
    """Return whether replacing foreign content is forced."""
    return _forced.get()


def require_free(place: Path, *, expected: str, is_ours: bool = False, found: str = "") -> None:
    """Raise OutputError if a result would replace content that is not its own earlier result.

    expected  allowed content, for the message
    is_ours   whether the caller has recognised an earlier result of the same specimen
    found     words for the content; empty: those of `contents_of`
    """
    if is_ours or is_forced():
        return
    there = contents_of(place)
    if there.kind is not Kind.NOTHING:
        raise refused(place, found or there.words, expected)


def refused(place: Path | str, found: str, expected: str) -> OutputError:
    """Return the error for a place that holds foreign content."""
    return OutputError(
        f"{place}: holds {found}, expected {expected}: {or_force('choose another place')}"
    )


def or_force(remedy: str) -> str:
    """Return a remedy, followed by the way to replace the content by force, if there is one."""
    words = _force_words.get()
    return f"{remedy}, or {words} replaces it" if words else remedy
