"""Read cells of text as numbers, in the convention of the program that wrote the table.

A table has one decimal mark, a point or a comma. The other mark may separate groups of three
digits, and so may spaces and apostrophes. `1.234` and `1,234` fit both conventions, so other cells
of the column decide, then other columns, then the separator between cells. A column holds numbers
if nearly all its cells do. A few words among them count as missing values and are quoted in a note.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.read.tables.cell_units import without_unit
from stereocell.read.tables.table import MISSING, TableColumn, word_of

POINT, COMMA = ".", ","
_SEMICOLON = ";"  # separates cells in tables with a decimal comma
_MOST_WORDS = 5  # different words that may stand among numbers; error values don't count
_MOST_SHARE = 0.25  # share of the filled cells that may be words in a column of numbers
# that share for a column in which some numbers have fractions, since codes of categories have none
_MOST_SHARE_OF_FRACTIONS = 0.5
_MIXED = 0.25  # share of numbers in a column of texts above which a note counts them
_SHOWN = 4  # words or columns that a note lists
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
_EITHER = re.compile(r"[+-]?[1-9][0-9]{0,2}[.,][0-9]{3}")  # a number in both conventions
_SPACES = "\u00a0\u2009\u202f '\u2019"
_SPACED = re.compile(rf"(?<=[0-9])[{_SPACES}](?=[0-9]{{3}}(?![0-9]))")
# words of spreadsheets and measuring programs that are not numbers, in lower case
_NO_NUMBER = re.compile(
    r"#.*|[-+]?1\.#.*|-+|\.+|\?+|[\u2013\u2014]|[+-]?inf(inity)?|[+-]nan|n\.?d\.?"
)
_NAMES = {POINT: "point", COMMA: "comma"}
_MARKERS = (-999.0, -9999.0, -99999.0)  # numbers that programs write for a missing value


@dataclass(frozen=True, slots=True)
class Reading:
    """The columns of a table of text, and notes on how its cells were read."""

    columns: tuple[TableColumn, ...]
    notes: tuple[str, ...]


def read_columns(named: Mapping[str, Sequence[str]], separator: str) -> Reading:
    """Return columns of text, converted to numbers where they hold numbers.

    named      cells of each column, by name
    separator  mark between cells
    """
    columns, missing, notes, grouped = [], {}, [], ""
    bare = {name: without_unit(name, texts) for name, texts in named.items()}
    notes += [note for _, note in bare.values() if note]
    conventions = _conventions({name: texts for name, (texts, _) in bare.items()}, separator)
    for name, (texts, _) in bare.items():
        mark, note = conventions[name]
        numbers, words = _numbers(texts, mark)
        if _are_numbers(numbers, words):
            columns.append(TableColumn(name, numbers, None))
            missing[name] = words
            notes += [note] if note else []
            notes += _marker_notes(name, numbers)
            grouped = grouped or ("" if note else _grouped_note(texts, mark))
        else:
            columns.append(TableColumn(name, None, tuple(map(word_of, named[name]))))
            notes += _mixed_notes(name, numbers, words)
    notes += [grouped] if grouped else []
    return Reading(tuple(columns), (*_missing_notes(missing), *notes))


def read_stored_texts(named: Mapping[str, Sequence[str]]) -> Reading:
    """Return text columns of a typed file, converted to numbers where they hold numbers."""
    reading = read_columns(named, "")
    holds = [
        column.numbers is not None and bool(np.isfinite(column.numbers).any())
        for column in reading.columns
    ]
    columns = [
        column if is_number else TableColumn(column.name, None, tuple(map(word_of, texts)))
        for column, is_number, texts in zip(reading.columns, holds, named.values(), strict=True)
    ]
    found = [
        repr(one.name)[:60] for one, is_number in zip(columns, holds, strict=True) if is_number
    ]
    more = f" and {len(found) - _SHOWN} more" * (len(found) > _SHOWN)
    notes = [f"numbers stored as texts are read as numbers: {', '.join(found[:_SHOWN])}{more}"]
    return Reading(tuple(columns), (*notes * bool(found), *reading.notes))


def decimal_mark(texts: Sequence[str], separator: str) -> str:
    """Return the decimal mark of one column."""
    return _conventions({"": texts}, separator)[""][0]


def _conventions(named: Mapping[str, Sequence[str]], separator: str) -> dict[str, tuple[str, str]]:
    """Return each column's decimal mark, and a note if the other mark would fit as well."""
    has_comma = any(COMMA in "\n".join(texts) for texts in named.values())
    if not has_comma and separator != _SEMICOLON:
        return dict.fromkeys(named, (POINT, ""))
    found = {name: _marks_of(texts) for name, texts in named.items()}
    of_table = Counter(next(iter(marks)) for marks, _ in found.values() if len(marks) == 1)
    conventions = {}
    for name, (marks, example) in found.items():
        mark = next(iter(marks)) if marks else ""
        note, is_uncertain = "", False
        if not mark and of_table and example:
            mark = of_table.most_common(1)[0][0]
            reason = "as in other columns of the table"
        elif not mark and example:
            mark = POINT if separator == COMMA or POINT in example else COMMA
            reason = "since no other cell distinguishes them"
            is_uncertain = separator == _SEMICOLON or mark not in example
        if not marks and example and (is_uncertain or mark not in example):
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
    """Return a note on marks between thousands in a column of numbers; empty: there are none."""
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
    """Return the numbers, NaN for cells without one, and counts of those cells' texts."""
    numbers = np.full(len(texts), np.nan)
    words: Counter[str] = Counter()
    for row, text in enumerate(texts):
        value = _value(text, mark)
        if isfinite(value):
            numbers[row] = value
        else:
            words[text.strip()] += 1
    return numbers, words


def _value(text: str, mark: str) -> float:
    """Return a cell's number; NaN: it holds no number."""
    try:
        if mark == POINT and "_" not in text:  # float also accepts underscores between digits
            return float(text)
    except ValueError:
        pass
    try:
        return float(_plain(text, mark))
    except ValueError:
        return float("nan")


def _plain(text: str, mark: str) -> str:
    """Return a number's text with a decimal point and without marks between thousands.

    Raises ValueError where it is not a number.
    """
    text = _SPACED.sub("", text.strip().replace("\u2212", "-"))
    if _GROUPED[mark].fullmatch(text):
        text = text.replace(COMMA if mark == POINT else POINT, "")
    if not _PLAIN[mark].fullmatch(text):
        raise ValueError
    return text.replace(mark, POINT)


def _are_numbers(numbers: NDArray[np.float64], words: Counter[str]) -> bool:
    """Return whether a column holds numbers, perhaps with missing values among them."""
    others = {word: times for word, times in words.items() if not _means_missing(word)}
    if not others:
        has_errors = any(word.lower() not in MISSING for word in words)
        return not has_errors or bool(np.isfinite(numbers).any())
    filled = len(numbers) - sum(words[word] for word in words if word.lower() in MISSING)
    finite = numbers[np.isfinite(numbers)]
    most = _MOST_SHARE_OF_FRACTIONS if (finite % 1 != 0).any() else _MOST_SHARE
    is_few = len(others) <= _MOST_WORDS and sum(others.values()) <= most * filled
    return is_few and bool(len(finite))


def _marker_notes(name: str, numbers: NDArray[np.float64]) -> Iterator[str]:
    """Yield a note on a number that means a missing value in many files."""
    finite = numbers[np.isfinite(numbers)]
    for marker in _MARKERS:
        count = int((finite == marker).sum())
        if count and finite.min() == marker and not ((finite < 0) & (finite > marker)).any():
            cells = f"{count:,} cells" if count > 1 else "1 cell"
            yield (
                f"column {name!r:.60}: {marker:g} in {cells} is read as a number: empty the cells "
                "if it means that a value is missing"
            )


def _mixed_notes(name: str, numbers: NDArray[np.float64], words: Counter[str]) -> Iterator[str]:
    """Yield a note on a column of texts if many of its cells are numbers."""
    filled = len(numbers) - sum(words[word] for word in words if word.lower() in MISSING)
    count = int(np.isfinite(numbers).sum())
    if count and count >= _MIXED * filled:
        word = next(word for word, _ in words.most_common() if word.lower() not in MISSING)
        yield (
            f"column {name!r:.60}: {count:,} of {filled:,} cells are numbers, others are words "
            f"such as {word!r:.40}: read as texts"
        )


def _means_missing(word: str) -> bool:
    lower = word.lower()
    return lower in MISSING or _NO_NUMBER.fullmatch(lower) is not None


def _missing_notes(missing: Mapping[str, Counter[str]]) -> Iterator[str]:
    """Yield one note on all cells without a number in columns of numbers."""
    found = {name: words for name, words in missing.items() if words}
    if not found:
        return
    parts = []
    for name, words in list(found.items())[:_SHOWN]:
        kinds = [
            f"{f'{word!r:.40}' if word else 'empty'} ({times:,})"
            for word, times in words.most_common(_SHOWN)
        ]
        more = len(words) - len(kinds)
        parts.append(f"{name:.60}: {', '.join(kinds)}{f' and {more} other words' * bool(more)}")
    more = len(found) - len(parts)
    parts += [f"and {more} more columns"] * bool(more)
    total = sum(words.total() for words in found.values())
    noun = "cells" if total > 1 else "cell"
    yield f"{total:,} {noun} in columns of numbers read as missing values: {'; '.join(parts)}"
