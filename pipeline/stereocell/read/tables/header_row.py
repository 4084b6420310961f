"""Find the header of a text table: the separator between its cells, and the line of column names.

Programs write lines before the header: a title and a rule (Imaris), names of groups of columns
(CellProfiler), `sep=;` (spreadsheets), or comments. The header is the first line that names a
column of objects' numbers, if no line before it looks like a row of the table.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from stereocell.read.tables.table import KEYS, clean

SEPARATORS = "\t,;|"
SEARCHED_LINES = 64  # first lines of a table that are searched for the header
_STATED = re.compile(r"\s*\"?sep=(.)\"?\s*")  # line by which spreadsheets state the separator


@dataclass(frozen=True, slots=True)
class Header:
    """The header of a table.

    separator  mark between cells
    skipped    number of lines before the header
    names      names of the columns; empty text: a column without a name
    note       note on the lines before the header; empty: there are none
    """

    separator: str
    skipped: int
    names: tuple[str, ...]
    note: str = ""


def find_header(lines: Sequence[str], key: str) -> Header:
    """Return the header in the first lines of a table; its names are empty if there is none.

    key  name of the column of the objects' numbers; empty: any of KEYS
    """
    given = _STATED.fullmatch(lines[0]) if lines else None
    stated = given[1] if given else ""
    wanted = {key} if key else {name.lower() for name in KEYS}
    best = Header("", 0, ())
    for separator in stated or SEPARATORS:
        found = _with_key(lines, separator, wanted, is_exact=bool(key))
        if found is not None and len(found.names) > len(best.names):
            best = found
    if best.names:
        return best
    skipped = next((at for at, line in enumerate(lines) if line.strip() and not stated), 0)
    skipped += bool(stated)
    line = lines[skipped] if skipped < len(lines) else ""
    separator = stated or max(SEPARATORS, key=line.count)
    return Header(separator, skipped, tuple(next(csv.reader([line], delimiter=separator), ())))


def _with_key(
    lines: Sequence[str], separator: str, wanted: set[str], *, is_exact: bool
) -> Header | None:
    """Return the header if a line, split at this separator, names a column of objects' numbers."""
    reader = csv.reader(lines, delimiter=separator)
    before: list[list[str]] = []
    start = 0
    while (row := _next(reader)) is not None:
        names = [clean(name) for name in row]
        names[:1] = [name.removeprefix("#").strip() for name in names[:1]]
        if wanted & {name if is_exact else name.lower() for name in names}:
            is_plain = not any(map(_is_number, names))
            is_first = all(
                len(other) < len(row) or not any(map(_is_number, other)) for other in before
            )
            if not (is_plain and is_first):
                return None
            own = _with_group_names(names, before[-1] if before else [])
            note = _note(lines[:start])
            return Header(separator, start, tuple(own), note)
        before.append(row)
        start = reader.line_num
    return None


def _note(before: Sequence[str]) -> str:
    """Return the note on lines before a header. It quotes none, since they may name a person."""
    if not any(line.strip() and not _STATED.fullmatch(line) for line in before):
        return ""
    count = len(before)
    lines = f"{count} lines before it are" if count > 1 else "line before it is"
    return f"the names of the columns are in line {count + 1}; the {lines} left out"


def _next(reader: Iterator[list[str]]) -> list[str] | None:
    """Return the next row; None: there is no further row, or it can't be parsed."""
    try:
        return next(reader, None)
    except csv.Error:
        return None


def _with_group_names(names: list[str], groups: Sequence[str]) -> list[str]:
    """Return the names; repeated ones are preceded by the name of their group of columns."""
    if len(groups) != len(names):
        return names
    return [
        clean(f"{group} {name}") if names.count(name) > 1 else name
        for group, name in zip(groups, names, strict=True)
    ]


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True
