"""Check and prepare the words of a command line before they are parsed."""

import re
from collections.abc import Sequence

from stereocell.model.errors import UsageError
from stereocell.model.utf8 import escaped_bytes

_BELOW_ZERO = re.compile(r"-\.?\d")  # a negative number; no flag begins like this
# argparse of Python 3.11 drops the value `--` of a flag, which then has no value.
_NO_VALUE = re.compile(r"(--[a-z][a-z-]*(?==)|-[a-z])=?--")


def prepared(words: Sequence[str]) -> list[str]:
    """Return the words of a command line in the form that argparse needs.

    Values that begin with a minus and a digit, as `-20:20,:,:`, are joined to their flags, because
    argparse would read such a value as a flag. Raises UsageError for a value that is `--`, and for
    a word that is not UTF-8.
    """
    joined: list[str] = []
    is_open = True  # until the first bare `--`, after which there are no flags
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
    """Raise UsageError if a word is not UTF-8. Python keeps such bytes as lone surrogates."""
    if shown := escaped_bytes(word):
        raise UsageError(f"{where} is '{shown}', expected UTF-8: rename the file")
