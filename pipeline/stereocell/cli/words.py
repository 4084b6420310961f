"""Check and prepare the words of a command line before they are parsed."""

import re
from collections.abc import Sequence

from stereocell.model.errors import UsageError
from stereocell.model.utf8 import escaped_bytes

_BELOW_ZERO = re.compile(r"-\.?\d")  # no flag of ours has a digit there
# argparse of Python 3.11 removes `--` from the values of flags, so that no value is left
_NO_VALUE = re.compile(r"(--[a-z][a-z-]*(?==)|-[a-z])=?--")


def prepared(words: Sequence[str]) -> list[str]:
    """Return the words as argparse takes them.

    Values that begin with a minus and a digit are joined to their flags: argparse takes such a
    value, `-20:20,:,:`, for another flag. Raises UsageError for a value that is `--`, and for a
    word that is not UTF-8.
    """
    joined: list[str] = []
    is_open = True  # flags end at the first bare `--`
    for place, word in enumerate(words, 1):
        before = joined[-1] if joined else ""
        flag, is_joined, value = word.partition("=") if word.startswith("--") else ("", "", word)
        is_flag = re.fullmatch(r"--?[a-z][a-z-]*", before) is not None
        where = before if is_flag else f"argument {place}"
        _require_utf8(flag if is_joined else where, value if is_joined else word)
        is_open = is_open and word != "--"
        if is_open and (found := _NO_VALUE.fullmatch(word)):
            raise UsageError(f"{found[1]} is '--', expected a value (a file of this name is ./--)")
        if is_open and is_flag and before.startswith("--") and _BELOW_ZERO.match(word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def _require_utf8(where: str, word: str) -> None:
    """Raise UsageError for bytes that are not UTF-8, which Python keeps as lone surrogates."""
    if shown := escaped_bytes(word):
        raise UsageError(
            f"{where} is '{shown}', expected UTF-8: give a file with such a name another one"
        )
