"""Columns of tables whose format types them (Parquet, AnnData): numbers, texts and categories.

Programs store numbers as texts there too, such as a column in which a spreadsheet left `#DIV/0!`.
Such a column is read as one of CSV is. Whole numbers that repeat, or that the file itself calls
categories, stay names: clusters are called `0`, `1`, ... in this way.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.read.tables.missing_values import missing_notes, sentinel_notes
from stereocell.read.tables.number_texts import Reading, read_columns
from stereocell.read.tables.table import TableColumn, word_of


@dataclass(frozen=True, slots=True)
class StoredColumn:
    """One column as it is stored. Exactly one of numbers and texts has a value a row.

    numbers      NaN: missing
    texts        empty: missing
    is_category  whether the file calls the texts categories
    """

    name: str
    numbers: NDArray[np.float64] | None
    texts: Sequence[str] | None
    is_category: bool = False


def read_typed(stored: Sequence[StoredColumn]) -> Reading:
    """Return columns, those of texts as numbers where they hold numbers, and notes."""
    taken: dict[str, Sequence[str]] = {}
    notes: list[str] = []
    for one in stored:
        if one.texts is None or not any(map(_has_digit, set(one.texts))):
            continue
        is_number, note = _kind_of(one)
        notes += [note] if note else []
        if is_number:
            taken[one.name] = one.texts
    reading = read_columns(taken, "")
    by_name = {column.name: column for column in reading.columns}
    columns = tuple(by_name.get(one.name) or _plain(one) for one in stored)
    gaps = {one.name: _gaps(one.numbers) for one in stored if one.numbers is not None}
    numbers = [column for column in columns if column.name not in by_name]
    found = (*missing_notes(gaps), *sentinel_notes(numbers))
    if taken:
        listed = ", ".join(f"{name:.40}" for name in list(taken)[:4])
        more = f" and {len(taken) - 4} more" if len(taken) > 4 else ""
        notes.append(f"texts that hold numbers are read as numbers: {listed}{more}")
    return Reading(columns, (*found, *reading.notes, *notes))


def _kind_of(one: StoredColumn) -> tuple[bool, str]:
    """Return whether texts are read as numbers, and a note where they might be."""
    assert one.texts is not None
    reading = read_columns({one.name: one.texts}, "")
    numbers = reading.columns[0].numbers
    if numbers is None:
        return False, "; ".join(reading.notes)
    held = numbers[np.isfinite(numbers)]
    is_whole = bool((held == np.round(held)).all())
    distinct = len(np.unique(held))
    if not is_whole or (not one.is_category and distinct > len(held) / 2):
        return True, ""
    return False, (
        f"column {one.name!r:.60} holds whole numbers as texts: they are read as names of "
        f"{distinct:,} categories"
    )


def _has_digit(text: str) -> bool:
    return any(map(str.isdigit, text))


def _plain(one: StoredColumn) -> TableColumn:
    if one.texts is not None:
        return TableColumn(one.name, None, tuple(map(word_of, one.texts)))
    assert one.numbers is not None
    return TableColumn(one.name, np.where(np.isfinite(one.numbers), one.numbers, np.nan), None)


def _gaps(numbers: NDArray[np.float64]) -> Counter[str]:
    """Return the cells that hold no finite number, by their words."""
    infinite = int(np.isinf(numbers).sum())
    return +Counter({"": int(np.isnan(numbers).sum()), "infinite": infinite})
