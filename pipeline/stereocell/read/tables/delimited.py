"""Read tables of text, CSV and TSV, with the csv module.

pyarrow, an optional dependency, parses faster. But it handles no lines before a header, no marks
between thousands and no words among numbers, so all those checks would still be needed here.
"""

import codecs
import csv
import io
import os
from collections.abc import Iterator, Sequence
from itertools import chain, islice

from stereocell.model.errors import SourceError
from stereocell.read.tables.header_row import SEARCHED_LINES, Header, find_header
from stereocell.read.tables.number_texts import COMMA, decimal_mark, read_columns
from stereocell.read.tables.table import (
    MAX_NAMES,
    MAX_ROWS,
    Table,
    choose_columns,
    choose_key,
    keys_of,
    named,
    require_once,
)
from stereocell.storage.location import Location

_MAX_BYTES = 4 << 30  # bytes; a larger table is refused
_LONGEST = 1 << 17  # characters of the longest cell that the csv module accepts
_LONGEST_LINE = 1 << 24  # characters; a line with as many or more is refused
_BLOCK = 1 << 20  # bytes read at a time
_UTF16 = {codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
# bytes of Windows-1252 in units and European names: ° ± ² ³ µ · and all letters except þ and ÿ
_WESTERN = frozenset((*b"\xb0\xb1\xb2\xb3\xb5\xb7", *range(0xC0, 0xFE)))


def read_delimited(location: Location, key: str, wanted: tuple[str, ...]) -> Table:
    """Return a table of text. Raises SourceError."""
    where = location.shown
    try:
        size = os.path.getsize(location.source)
        if size > _MAX_BYTES:
            raise SourceError(f"{where}: found {size} bytes, expected at most {_MAX_BYTES}")
        encoding, note = _encoding_of(location.source)
        with open(location.source, encoding=encoding, newline="") as text:
            return _read(text, where, key, wanted, (note,) if note else ())
    except UnicodeDecodeError as error:
        raise SourceError(
            f"{where}: found bytes that are not text ({error.reason}), expected UTF-8"
        ) from None
    except csv.Error as error:
        raise SourceError(
            f"{where}: {error}, expected rows of cells of at most {_LONGEST} characters"
        ) from None
    except (OSError, EOFError) as error:
        reason = getattr(error, "strerror", None) or error
        raise SourceError(f"{where}: can't be read ({reason}), expected a table") from None


def _encoding_of(path: str) -> tuple[str, str]:
    """Return a text's encoding, and a note if the encoding is assumed."""
    decoder, is_utf8, others = codecs.getincrementaldecoder("utf-8")(), True, set[int]()
    with open(path, "rb") as file:
        head = file.read(4)
        if head[:2] in _UTF16:
            return _UTF16[head[:2]], ""
        if len(head) == 4 and 0 in head:
            if head[1] == head[3] == 0 and head[0] and head[2]:
                return "utf-16-le", ""
            if head[0] == head[2] == 0 and head[1] and head[3]:
                return "utf-16-be", ""
        file.seek(0)
        while block := file.read(_BLOCK):
            if block.isascii() and is_utf8:
                decoder.reset()
                continue
            others.update(byte for byte in set(block) if byte > 0x7F)
            try:
                decoder.decode(block)
            except UnicodeDecodeError:
                is_utf8 = False
    if is_utf8 or not others <= _WESTERN:
        return "utf-8-sig", ""
    return (
        "cp1252",
        "the text is not UTF-8: Windows-1252 is assumed, as Western spreadsheets write",
    )


def _read(
    text: io.TextIOWrapper, where: str, key: str, wanted: tuple[str, ...], notes: tuple[str, ...]
) -> Table:
    lines = _lines(text, where)
    first = list(islice(lines, SEARCHED_LINES))
    header = find_header(first, key)
    if not any(name.strip() for name in header.names):
        raise SourceError(f"{where}: found no header, expected column names in the first line")
    if len(header.names) > MAX_NAMES:
        raise SourceError(
            f"{where}: found {len(header.names)} columns, expected at most {MAX_NAMES}"
        )
    names = named(header.names)
    require_once(where, names)
    chosen_key = choose_key(where, names, key)
    taken, left_out = choose_columns(where, names, chosen_key, wanted)
    places = [names.index(name) for name in (chosen_key, *taken)]
    cells: list[list[str]] = [[] for _ in places]
    for row in _rows(chain(first[header.skipped :], lines), header, where):
        for held, place in zip(cells, places, strict=True):
            held.append(row[place])
    labels = keys_of(where, chosen_key, _as_keys(cells[0], header.separator), _hint(header, key))
    # A separator at the end of each line adds a column without a name and without values.
    held_cells = {
        name: texts
        for name, place, texts in zip(taken, places[1:], cells[1:], strict=True)
        if header.names[place] or any(texts)
    }
    reading = read_columns(held_cells, header.separator)
    notes = (*notes, *filter(None, [header.note]), *reading.notes)
    return Table(where, chosen_key, labels, reading.columns, left_out, notes)


def _as_keys(texts: Sequence[str], separator: str) -> Sequence[str]:
    """Return objects' numbers with a decimal point: some programs write whole ones as `1,0`."""
    if any(COMMA in text for text in texts) and decimal_mark(texts, separator) == COMMA:
        return [text.replace(COMMA, ".") for text in texts]
    return texts


def _hint(header: Header, key: str) -> str:
    """Return the remedy if the key's column holds no numbers and the first one has no name."""
    if key or header.names[0].strip():
        return ""
    return "; --table-key 'column 1' takes the first column, which has no name"


def _lines(text: io.TextIOWrapper, where: str) -> Iterator[str]:
    """Yield the lines of a text. Raises SourceError for a line that is too long."""
    while line := text.readline(_LONGEST_LINE):
        if len(line) == _LONGEST_LINE:
            raise SourceError(
                f"{where}: found a line of {_LONGEST_LINE} characters or more, expected rows of "
                f"cells of at most {_LONGEST} characters"
            )
        yield line


def _rows(lines: Iterator[str], header: Header, where: str) -> Iterator[list[str]]:
    """Yield the rows below the header that hold anything, each as wide as the header."""
    width = len(header.names)
    required = max(place for place, name in enumerate(header.names, start=1) if name.strip())
    reader = csv.reader(lines, delimiter=header.separator)
    next(reader)
    for count, row in enumerate(reader):
        if count > MAX_ROWS:
            raise SourceError(f"{where}: found more than {MAX_ROWS} rows, expected at most that")
        if not any(row):
            continue
        if len(row) < required or any(row[width:]):
            raise SourceError(
                f"{where}: line {header.skipped + reader.line_num}: found {len(row)} cells, "
                f"expected {width}, as in the header"
            )
        yield (row + [""] * width)[:width]
