"""Read Parquet tables with pyarrow (Apache-2.0; the extra `tables`): numbers and texts.

The sizes that a file states are checked before it is read. It is read a batch of rows at a time,
and only the chosen columns are read.

libarrow aborts its process on some damaged files, so the reader runs in a child process
(storage/child_process.py).
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read import extras
from stereocell.read.tables.number_texts import read_stored_texts
from stereocell.read.tables.table import (
    MAX_NAMES,
    MAX_ROWS,
    Table,
    TableColumn,
    choose_columns,
    choose_key,
    clean,
    keys_of,
    require_once,
    word_of,
)
from stereocell.storage.child_process import Bounds, run_in_child
from stereocell.storage.library_errors import DamagedError, damage_words, one_line
from stereocell.storage.location import Location

_EXPECTED = "a complete Parquet file"
_BATCH = 1 << 16  # rows read at a time
_MOST_S = 600.0  # s; time limit for a table. 10 million rows take less than a tenth of it
_MAX_BYTES = 1 << 28  # bytes; a table with a larger column in a group of rows is refused
_INDEX = "__index_level_"  # pandas' name for an index without a name


@dataclass(frozen=True, slots=True)
class _Request:
    """The file's name for messages, the wanted columns, and the largest size of a column."""

    where: str
    key: str
    wanted: tuple[str, ...]
    most_bytes: int


def read_parquet(location: Location, key: str, wanted: tuple[str, ...]) -> Table:
    """Return a Parquet table. Raises SourceError."""
    where = location.shown
    extras.require_installed("pyarrow", "tables", where, "Parquet")
    request = _Request(where, key, wanted, _MAX_BYTES)
    with one_line(where, _EXPECTED):
        table: Table = run_in_child(_read_file, location.source, request, bounds=Bounds(_MOST_S))
    return table


def _read_file(path: str, request: _Request) -> Table:
    import pyarrow.parquet as parquet

    with one_line(request.where, _EXPECTED), open(path, "rb") as source:
        try:
            return _read(parquet, source, request)
        except (import_module("pyarrow").ArrowException, OSError) as error:
            # The rest of the message names Arrow's own classes.
            short = ValueError(str(error).partition(":")[0])
            if isinstance(error, NotImplementedError):
                raise short from error
            raise DamagedError(damage_words(short)) from error


def _read(parquet: Any, source: BinaryIO, request: _Request) -> Table:
    where, wanted = request.where, request.wanted
    file = parquet.ParquetFile(source)
    stated, schema = file.metadata, file.schema_arrow
    rows = int(stated.num_rows)
    if len(schema) > MAX_NAMES or not 0 <= rows <= MAX_ROWS:
        raise SourceError(
            f"{where}: found {rows} rows of {len(schema)} columns, expected at most {MAX_ROWS} "
            f"of {MAX_NAMES}"
        )
    require_once(where, schema.names)
    kinds = {field.name: _kind(field.type) for field in schema}
    names = [name for name, kind in kinds.items() if kind and not name.startswith(_INDEX)]
    chosen = choose_key(where, names, request.key)
    for name in wanted:
        if name in kinds and not kinds[name]:
            raise SourceError(
                f"{where}: column {clean(name)!r:.60}: found "
                f"{clean(str(schema.field(name).type)):.60}, expected numbers or texts"
            )
    taken, left_out = choose_columns(where, names, chosen, wanted)
    _require_small(stated, request, {chosen, *taken})
    # Dictionary-encoded, a text that many rows share is stored only once.
    texts = [name for name in (chosen, *taken) if kinds[name] == _TEXT]
    file = parquet.ParquetFile(
        source, metadata=stated, read_dictionary=texts, page_checksum_verification=True
    )
    keys: list[str] = []
    parts: dict[str, list[Any]] = {name: [] for name in taken}
    for batch in file.iter_batches(batch_size=_BATCH, columns=[chosen, *taken]):
        keys += [str(value) for value in batch.column(chosen).to_pylist()]
        for name, found in parts.items():
            column = batch.column(name)
            found.append(_numbers(column) if kinds[name] == _NUMBER else _words(column))
    if len(keys) != rows:
        raise SourceError(f"{where}: found {len(keys)} rows, expected {rows}, as the file states")
    columns = {name: _column(name, kinds[name], found) for name, found in parts.items()}
    plain = {
        name: columns[name].texts or () for name in taken if _is_plain_text(schema.field(name).type)
    }
    reading = read_stored_texts(plain)
    columns |= dict(zip(plain, reading.columns, strict=True))
    labels = keys_of(where, chosen, keys)
    return Table(where, chosen, labels, tuple(columns.values()), left_out, reading.notes)


_NUMBER, _TEXT = "number", "text"


def _kind(type_: Any) -> str:
    """Return the kind of a column's values; empty: neither numbers nor texts."""
    types = import_module("pyarrow.types")
    held = type_.value_type if types.is_dictionary(type_) else type_
    tests = (types.is_integer, types.is_floating, types.is_boolean, types.is_decimal, types.is_null)
    if held is type_ and any(test(held) for test in tests):
        return _NUMBER
    is_text = types.is_string(held) or types.is_large_string(held) or types.is_temporal(held)
    return _TEXT if is_text else ""


def _is_plain_text(type_: Any) -> bool:
    """Return whether a column holds texts that are neither categories nor times."""
    types = import_module("pyarrow.types")
    return bool(types.is_string(type_) or types.is_large_string(type_))


def _require_small(stated: Any, request: _Request, names: set[str]) -> None:
    for group in range(stated.num_row_groups):
        parts = stated.row_group(group)
        for place in range(parts.num_columns):
            part = parts.column(place)
            size = int(part.total_uncompressed_size)
            if part.path_in_schema in names and not 0 <= size <= request.most_bytes:
                raise SourceError(
                    f"{request.where}: column {clean(part.path_in_schema)!r:.60}: found {size} "
                    f"bytes in {parts.num_rows} rows, expected at most {request.most_bytes}"
                )


def _numbers(column: Any) -> NDArray[np.float64]:
    """Return a column's numbers; NaN: missing."""
    cast = import_module("pyarrow.compute").cast(column, "float64", safe=False)
    return np.asarray(cast.to_numpy(zero_copy_only=False), np.float64)


def _words(column: Any) -> list[str]:
    """Return a column's texts; empty: missing."""
    coded = column if hasattr(column, "dictionary") else column.cast("string").dictionary_encode()
    words = [word_of(str(text)) for text in coded.dictionary.to_pylist()]
    return ["" if code is None else words[code] for code in coded.indices.to_pylist()]


def _column(name: str, kind: str, parts: list[Any]) -> TableColumn:
    shown = clean(name) or "column"
    if kind == _NUMBER:
        return TableColumn(shown, np.concatenate(parts or [np.zeros(0)]), None)
    return TableColumn(shown, None, tuple(text for part in parts for text in part))
