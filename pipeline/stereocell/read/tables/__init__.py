"""Tables with one row per object: CSV, TSV, Parquet, and AnnData in Zarr and HDF5 (.h5ad)."""

import os

from stereocell.model.errors import SourceError
from stereocell.read.file_kind import require_kind
from stereocell.read.foreign_files import foreign_words
from stereocell.read.known_formats import identify, known_formats
from stereocell.read.tables.delimited import read_delimited
from stereocell.read.tables.parquet import read_parquet
from stereocell.read.tables.table import KEYS, Table, TableColumn
from stereocell.storage.file_states import unchanged_while_read
from stereocell.storage.first_bytes import pointer_words
from stereocell.storage.library_errors import library_boundary
from stereocell.storage.location import Location, first_bytes

_TEXTS = (".csv", ".tsv", ".txt")
_UTF16 = (b"\xff\xfe", b"\xfe\xff")  # first bytes of texts saved by Excel

__all__ = ["KEYS", "Table", "TableColumn", "read_table"]


def read_table(place: str, key: str, wanted: tuple[str, ...], labels: str) -> Table:
    """Return a table: its key and its columns, in the file's order.

    place   a file, or a Zarr group that holds a table
    key     column of the objects' numbers; empty: the first of KEYS that the table has
    wanted  names of columns; empty: all but the key
    labels  name of the label map, for a table that describes several

    Raises SourceError where the table can't be read, changes while it is read, or lacks a column.
    """
    location = Location.of(place)
    with (
        unchanged_while_read(location, "run the same command again"),
        library_boundary(location.shown, "a complete table"),
    ):
        return _read(location, key, wanted, labels)


def _read(location: Location, key: str, wanted: tuple[str, ...], labels: str) -> Table:
    name = location.parts[-1].lower() if location.parts else ""
    if name.endswith((*_TEXTS, ".parquet", ".h5ad")) and location.is_local:
        _require_sound(location, name)
    if name.endswith(_TEXTS):
        return read_delimited(location, key, wanted)
    if name.endswith((".parquet", ".h5ad")) and not location.is_local:
        raise SourceError(f"{location.shown}: found an address, expected a file on this machine")
    if name.endswith(".parquet"):
        return read_parquet(location, key, wanted)
    # h5py is slow to import, and every command and worker would pay for it.
    from stereocell.read.tables.stores import read_anndata_zarr, read_h5ad

    if name.endswith(".h5ad"):
        return read_h5ad(location, key, wanted, labels)
    if any(part.endswith(".zarr") for part in location.parts):
        return read_anndata_zarr(location, key, wanted, labels)
    words = foreign_words(name)
    found = f": found {words}" if words else ""
    raise SourceError(
        f"{location.shown}: unknown kind of table{found}, expected .csv, .tsv, .parquet, .h5ad, "
        "or a table in a .zarr"
    )


def _require_sound(location: Location, name: str) -> None:
    """Refuse folders, files of another kind than their name says, and pipes or devices.

    A pipe or device may never end. Raises SourceError.
    """
    path = os.path.realpath(location.source)
    if os.path.exists(path) and not os.path.isfile(path):
        raise SourceError(f"{location.shown}: found no regular file, expected a table")
    head = first_bytes(path)
    if words := pointer_words(head):
        raise SourceError(f"{location.shown}: found {words}, expected a table")
    content = identify(head)
    if name.endswith(_TEXTS) and content.is_known and b"\0" in head and head[:2] not in _UTF16:
        raise SourceError(f"{location.shown}: found {content.words}, expected a table of text")
    if name.endswith(".parquet") and head and not head.startswith(b"PAR1"):
        raise SourceError(f"{location.shown}: found {identify(head).words}, expected Parquet")
    if name.endswith(".h5ad"):
        require_kind(location, known_formats()["hdf5"])
