"""Tables of text: CSV and TSV. The csv module reads them."""

import csv
import io
import os
from collections.abc import Iterator

from stereocell.model.errors import SourceError
from stereocell.read.tables.table import (
    MAX_NAMES,
    MAX_ROWS,
    Table,
    as_column,
    choose_columns,
    choose_key,
    keys_of,
    named,
    require_once,
)
from stereocell.storage.location import Location

_MAX_BYTES = 4 << 30  # most bytes of a table
_LONGEST = 1 << 17  # characters of a cell: the csv module's own limit
_LONGEST_LINE = 1 << 24  # characters


def read_delimited(location: Location, key: str, wanted: tuple[str, ...]) -> Table:
    """Return a table of text. Raises SourceError."""
    where = location.shown
    try:
        size = os.path.getsize(location.source)
        if size > _MAX_BYTES:
            raise SourceError(f"{where}: found {size} bytes, expected at most {_MAX_BYTES}")
        with open(location.source, encoding="utf-8-sig", newline="") as text:
            return _read(text, where, key, wanted)
    except UnicodeDecodeError as error:
        raise SourceError(
            f"{where}: found bytes that are no text ({error.reason}), expected UTF-8"
        ) from None
    except csv.Error as error:
        raise SourceError(
            f"{where}: {error}, expected rows of cells of at most {_LONGEST} characters"
        ) from None
    except (OSError, EOFError) as error:
        reason = getattr(error, "strerror", None) or error
        raise SourceError(f"{where}: can't be read ({reason}), expected a table") from None


def _read(text: io.TextIOWrapper, where: str, key: str, wanted: tuple[str, ...]) -> Table:
    first = text.readline(_LONGEST_LINE)
    if not first.strip():
        raise SourceError(f"{where}: found no header, expected names of columns in the first line")
    mark = max("\t,;", key=first.count)
    header = next(csv.reader([first], delimiter=mark))
    if len(header) > MAX_NAMES:
        raise SourceError(f"{where}: found {len(header)} columns, expected at most {MAX_NAMES}")
    names = named(header)
    require_once(where, names)
    chosen_key = choose_key(where, names, key)
    taken, left_out = choose_columns(where, names, chosen_key, wanted)
    places = [names.index(name) for name in (chosen_key, *taken)]
    cells: list[list[str]] = [[] for _ in places]
    for row in _rows(text, mark, where, len(names)):
        for held, place in zip(cells, places, strict=True):
            held.append(row[place])
    point = "," if mark == ";" else "."  # where a comma is the point, it parts no cells
    labels = keys_of(where, chosen_key, cells[0])
    columns = tuple(
        as_column(name, texts, point=point) for name, texts in zip(taken, cells[1:], strict=True)
    )
    return Table(where, chosen_key, labels, columns, left_out)


def _lines(text: io.TextIOWrapper, where: str) -> Iterator[str]:
    """Yield the lines of a text, none of which is read where it has no end."""
    while line := text.readline(_LONGEST_LINE):
        if len(line) == _LONGEST_LINE:
            raise SourceError(
                f"{where}: found a line of {_LONGEST_LINE} characters or more, expected rows of "
                f"cells of at most {_LONGEST} characters"
            )
        yield line


def _rows(text: io.TextIOWrapper, mark: str, where: str, width: int) -> Iterator[list[str]]:
    for number, row in enumerate(csv.reader(_lines(text, where), delimiter=mark), start=2):
        if number > MAX_ROWS:
            raise SourceError(f"{where}: found more than {MAX_ROWS} rows, expected at most those")
        if not row:
            continue
        if len(row) != width:
            raise SourceError(
                f"{where}: line {number}: found {len(row)} cells, expected {width} as the header"
            )
        yield row
