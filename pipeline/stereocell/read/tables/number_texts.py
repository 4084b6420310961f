"""Read cells of text as numbers, in the convention of the program that wrote the table.

A table has one decimal mark, a point or a comma. The other one may stand between groups of three
digits, as spaces and apostrophes may. `1.234` and `1,234` fit both conventions, so other cells of
the column decide, then other columns, then the mark between cells. A column holds numbers if nearly
all of its cells do, or most of them with one word among the rest: such words are missing values,
and are quoted in a note. Units behind the numbers (cell_units.py) are left out.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.read.tables.cell_units import unit_of
from stereocell.read.tables.missing_values import (
    SHOWN,
    means_missing,
    missing_notes,
    sentinel_notes,
)
from stereocell.read.tables.table import MISSING, TableColumn, word_of

POINT, COMMA = ".", ","
_MOST_WORDS = 5  # different words that may stand among numbers; error values don't count
_MOST_SHARE = 0.25  # of the cells with something in them, that may be such words
_LEAST_NUMBERS = 6  # cells with a number, for a word that stands in more cells than that share
_EXPONENT = r"([eE][+-]?[0-9]+)?"
_PLAIN = {
    mark: re.compile(rf"[+-]?([0-9]+{re.escape(mark)}?[0-9]*|{re.escape(mark)}[0-9]+){_EXPONENT}")
    for mark in (POINT, COMMA)
}
_GROUPED = {
    mark: re.compile(
        rf"[+-]?[1-9][0-9]{{0,2}}({re.escape(other)}[0-9]{{3}})+({re.escape(mark)}[0-9]*)?"
    )
    for mark, other in ((POINT, COMMA), (COMMA, POINT))
}
_EITHER = re.compile(r"[+-]?[1-9][0-9]{0,2}[.,][0-9]{3}")  # a number by both conventions
_SPACES = "\u00a0\u2009\u202f '\u2019"
_SPACED = re.compile(rf"(?<=[0-9])[{_SPACES}](?=[0-9]{{3}}(?![0-9]))")
_NAMES = {POINT: "point", COMMA: "comma"}


@dataclass(frozen=True, slots=True)
class Reading:
    """The columns of a table of text, and notes on how its cells were read."""

    columns: tuple[TableColumn, ...]
    notes: tuple[str, ...]


def read_columns(named: Mapping[str, Sequence[str]], separator: str) -> Reading:
    """Return columns of text as numbers where they are numbers.

    named      the cells of each column
    separator  the mark between cells; empty: the table has cells of its own
    """
    found = {name: unit_of(name, texts) for name, texts in named.items()}
    units = {name: unit for name, (unit, _) in found.items() if unit is not None}
    bare = {name: units[name].texts if name in units else named[name] for name in named}
    columns, missing, notes, grouped = [], {}, [note for _, note in found.values() if note], ""
    conventions = _conventions(bare, separator)
    for name, texts in bare.items():
        mark, note = conventions[name]
        numbers, words = _numbers(texts, mark)
        if _are_numbers(numbers, words):
            columns.append(TableColumn(name, numbers, None))
            missing[name] = words
            if mark == COMMA and not separator and not note:
                note = f"decimal mark of column {name!r:.60}: a comma, as its cells show"
            notes += [note] if note else []
            grouped = grouped or _grouped_note(texts, mark)
            if name in units:
                row = list(named[name]).index(units[name].example)
                notes.append(units[name].note(name, float(numbers[row])))
        else:
            columns.append(TableColumn(name, None, tuple(map(word_of, named[name]))))
            notes += _names_note(name, numbers, words)
    notes += [grouped] if grouped else []
    return Reading(tuple(columns), (*missing_notes(missing), *sentinel_notes(columns), *notes))


def _names_note(name: str, numbers: NDArray[np.float64], words: Counter[str]) -> list[str]:
    """Return a note on a column of names most of which look like numbers; none on others."""
    filled = len(numbers) - sum(words[word] for word in words if word.lower() in MISSING)
    count = int(np.isfinite(numbers).sum())
    if count < filled / 2 or not count:
        return []
    listed = ", ".join(f"{word!r:.40}" for word, _ in words.most_common(SHOWN) if word)
    return [
        f"column {name!r:.60}: {count:,} of {filled:,} cells hold numbers, the others words "
        f"({listed}): it is read as names of categories"
    ]


def decimal_mark(texts: Sequence[str], separator: str) -> str:
    """Return the mark before the fractions of one column."""
    return _conventions({"": texts}, separator)[""][0]


def _conventions(named: Mapping[str, Sequence[str]], separator: str) -> dict[str, tuple[str, str]]:
    """Return each column's decimal mark, and a note where another one would fit its cells too."""
    has_comma = any(COMMA in text for texts in named.values() for text in texts)
    if not has_comma and separator in (COMMA, ""):
        return dict.fromkeys(named, (POINT, ""))
    found = {name: _marks_of(texts) for name, texts in named.items()}
    of_table = Counter(next(iter(marks)) for marks, _ in found.values() if len(marks) == 1)
    conventions = {}
    for name, (marks, example) in found.items():
        mark = next(iter(marks)) if marks else ""
        note = ""
        if not mark and of_table and example:
            mark = of_table.most_common(1)[0][0]
            reason = "as in other columns of the table"
        elif not mark and example:
            mark = POINT if separator == COMMA or POINT in example else COMMA
            reason = "as no other cell tells them apart"
        is_unclear = separator == ";" and not of_table
        if not marks and example and (is_unclear or not mark == POINT in example):
            note = _ambiguous(name, example, mark, reason)
        conventions[name] = mark or POINT, note
    return conventions


def _marks_of(texts: Sequence[str]) -> tuple[set[str], str]:
    """Return the decimal marks that a column's cells show, and a cell that fits both marks."""
    marks, example = set(), ""
    for text in texts:
        if COMMA not in text and POINT not in text:
            continue
        text = _SPACED.sub("", text.strip())
        if _EITHER.fullmatch(text):
            example = text if not example or (COMMA in text) > (COMMA in example) else example
            continue
        for mark in (POINT, COMMA):
            if _PLAIN[mark].fullmatch(text) or _GROUPED[mark].fullmatch(text):
                marks.add(mark)
    return marks, example


def _ambiguous(name: str, example: str, mark: str, reason: str) -> str:
    value = float(_plain(example, mark))
    subject = Subject(
        f"decimal mark of column {name!r:.60}", remedy="write numbers without marks for thousands"
    )
    shown = f"a {_NAMES[mark]} ({example} is {value:.10g})"
    return settle(subject, [Statement(shown, reason, Trust.ASSUMED)]).notes[0]


def _grouped_note(texts: Sequence[str], mark: str) -> str:
    """Return the note on marks between thousands in a column of numbers; empty: it has none."""
    joined = "\n".join(texts)
    if not any(one in joined for one in (*_SPACES, COMMA if mark == POINT else POINT)):
        return ""
    for text in map(str.strip, texts):
        if _SPACED.search(text) or _GROUPED[mark].fullmatch(_SPACED.sub("", text)):
            value = _value(text, mark)
            if isfinite(value):
                return f"marks between thousands are left out: {text} is {value:.10g}"
    return ""


def _numbers(texts: Sequence[str], mark: str) -> tuple[NDArray[np.float64], Counter[str]]:
    """Return numbers, NaN where there is none, and the cells without one, as they are written."""
    values = {text: _value(text, mark) for text in set(texts)}
    numbers = np.fromiter((values[text] for text in texts), np.float64, len(texts))
    numbers[~np.isfinite(numbers)] = np.nan
    words = Counter(text.strip() for text in texts if not isfinite(values[text]))
    return numbers, words


def _value(text: str, mark: str) -> float:
    """Return a cell's number; NaN: it holds none."""
    try:
        if mark == POINT and "_" not in text:  # float also takes an underscore between digits
            return float(text)
    except ValueError:
        pass
    try:
        return float(_plain(text, mark))
    except ValueError:
        return float("nan")


def _plain(text: str, mark: str) -> str:
    """Return a number's text with a decimal point and nothing between thousands.

    Raises ValueError where it is no number.
    """
    text = _SPACED.sub("", text.strip().replace("\u2212", "-"))
    if _GROUPED[mark].fullmatch(text):
        text = text.replace(COMMA if mark == POINT else POINT, "")
    if not _PLAIN[mark].fullmatch(text):
        raise ValueError
    return text.replace(mark, POINT)


def _are_numbers(numbers: NDArray[np.float64], words: Counter[str]) -> bool:
    """Return whether a column holds numbers, with missing ones among them."""
    others = {word: times for word, times in words.items() if not means_missing(word)}
    if not others:
        has_errors = any(word.lower() not in MISSING for word in words)
        return not has_errors or bool(np.isfinite(numbers).any())
    filled = len(numbers) - sum(words[word] for word in words if word.lower() in MISSING)
    is_few = len(others) <= _MOST_WORDS and sum(others.values()) <= _MOST_SHARE * filled
    held = numbers[np.isfinite(numbers)]
    # codes of categories repeat, measured values don't
    is_measured = len(np.unique(held)) > len(held) / 2 >= filled / 4
    is_one = len(others) == 1 and len(held) >= _LEAST_NUMBERS and is_measured
    return (is_few or is_one) and len(held) > 0
