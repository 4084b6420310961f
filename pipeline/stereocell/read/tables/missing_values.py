"""Cells of a table that hold no measured value, and notes that quote them."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from stereocell.read.tables.table import MISSING, TableColumn

SHOWN = 4  # words, or columns, that a note lists
# numbers that programs write for a missing value, where all other values are 0 or more
_SENTINELS = (-999.0, -9999.0, -99999.0, -32768.0, -2147483648.0)
# words of spreadsheets and measuring programs that stand for no number, in small letters
_NO_NUMBER = re.compile(
    r"#.*|[-+]?1\.#.*|-+|\.+|\?+|[\u2013\u2014]|[+-]?inf(inity)?|[+-]nan|n\.?[ad]\.?|missing|"
    r"unknown|undefined|bdl|not (available|measured|detected|determined|applicable)"
)


def means_missing(word: str) -> bool:
    """Return whether a cell's word stands for a missing value."""
    lower = word.lower()
    return lower in MISSING or _NO_NUMBER.fullmatch(lower) is not None


def missing_notes(missing: Mapping[str, Counter[str]]) -> Iterator[str]:
    """Yield one note on all cells among numbers that hold none.

    missing  such cells of each column, as they are written, with how often they occur
    """
    found = {name: words for name, words in missing.items() if words}
    if not found:
        return
    parts = []
    for name, words in list(found.items())[:SHOWN]:
        kinds = [
            f"{f'{word!r:.40}' if word else 'empty'} ({times:,})"
            for word, times in words.most_common(SHOWN)
        ]
        more = len(words) - len(kinds)
        parts.append(f"{name:.60}: {', '.join(kinds)}{f' and {more} other words' * bool(more)}")
    more = len(found) - len(parts)
    parts += [f"and {more} more columns"] * bool(more)
    total = sum(words.total() for words in found.values())
    noun = "cells" if total > 1 else "cell"
    yield f"{total:,} {noun} in columns of numbers taken for missing values: {'; '.join(parts)}"


def sentinel_notes(columns: Sequence[TableColumn]) -> Iterator[str]:
    """Yield a note on each column where one number seems to stand for a missing value."""
    for column in columns:
        numbers = column.numbers
        if numbers is None:
            continue
        negative = numbers[numbers < 0]
        if len(negative) and negative[0] in _SENTINELS and (negative == negative[0]).all():
            yield (
                f"column {column.name!r:.60}: {negative[0]:g} ({len(negative):,} times) is read "
                "as a number, and no other value is below 0: where it stands for a missing value, "
                "leave the cell empty"
            )
