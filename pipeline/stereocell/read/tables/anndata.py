"""Read AnnData tables in Zarr and HDF5 (.h5ad): `obs`, and the columns of `X` named by `var`.

A SpatialData store holds such tables below `tables/`. Its own library would bring 60 others, so
zarr and h5py are used directly. X is read a block at a time: of ten thousand genes 128 are taken.

References
AnnData's on-disk format, https://anndata.readthedocs.io/en/latest/fileformat-prose.html
SpatialData's design document, https://spatialdata.scverse.org/
"""

from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.stated_numbers import number_of
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
    named,
)

_ATTRIBUTES = "spatialdata_attrs"  # key in `uns` that names the label map of the rows
_BLOCK = 1 << 22  # values of X that are read at a time
_MAX_VALUES = 1 << 28  # values of X that are read in all


class Node(Protocol):
    """A group or an array of a store.

    shape  shape of an array; None: a group
    """

    @property
    def shape(self) -> tuple[int, ...] | None: ...

    def attribute(self, name: str) -> Any:
        """Return an attribute, text as str; None: there is no such attribute."""

    def find(self, name: str) -> Self | None:
        """Return a member of a group; None: there is no such member."""

    def read(self, key: Any) -> NDArray[Any]:
        """Return a part of an array; texts have dtype object."""


def read_anndata(root: Node, where: str, key: str, wanted: tuple[str, ...], labels: str) -> Table:
    """Return an AnnData table; of rows for several label maps, only the rows for `labels`.

    Raises SourceError.
    """
    obs = root.find("obs")
    if obs is None or obs.shape is not None:
        raise SourceError(f"{where}: found no group `obs`, expected a table of AnnData")
    if obs.find("__categories") is not None:
        raise SourceError(
            f"{where}: obs: found categories in the form before AnnData 0.8, expected a newer "
            "file: read it and write it again with a newer AnnData"
        )
    order = obs.attribute("column-order")
    if order is None or len(order) > MAX_NAMES:
        found = "nothing" if order is None else f"{len(order)} names"
        raise SourceError(
            f"{where}: obs: column-order: found {found}, expected at most {MAX_NAMES} names"
        )
    names = [str(name) for name in order]
    about = _about(root)
    own_key = str(about.get("instance_key", ""))
    chosen = choose_key(where, names, key or (own_key if own_key in names else ""))
    keys = _series(_found(obs, chosen), f"{where}: obs/{chosen}")
    kept = np.ones(len(keys), bool)
    region_key = about.get("region_key", "")
    if region_key in names:
        regions = _series(_found(obs, region_key), f"{where}: obs/{region_key}")
        _require_rows(where, region_key, regions, len(keys))
        kept = np.array([str(region) == labels for region in regions], bool)
        if not kept.any():
            found = ", ".join(sorted({clean(str(region))[:40] for region in regions})[:8])
            raise SourceError(
                f"{where}: found rows for {found or 'no label map'}, expected some for {labels}"
            )
    matrix = root.find("X")
    genes = [] if matrix is None else named(_index(_found(root, "var"), where))
    own = [name for name in names if name not in (chosen, region_key)]
    taken, left_out = choose_columns(where, list(dict.fromkeys([*own, *genes])), chosen, wanted)
    places = [genes.index(name) for name in taken if name not in own]
    size = (len(keys), len(genes))
    numbers = _columns_of(matrix, where, size, places) if matrix is not None and places else None
    columns: dict[str, TableColumn] = {}
    plain: dict[str, tuple[str, ...]] = {}
    for name in taken:
        if name in own:
            node = _found(obs, name)
            values = _series(node, f"{where}: obs/{clean(name):.60}")
            _require_rows(where, name, values, len(keys))
            columns[name] = _column(clean(name) or "column", values, kept)
            if columns[name].texts and node.attribute("encoding-type") != "categorical":
                plain[columns[name].name] = columns[name].texts or ()
        elif numbers is not None:
            column = numbers[:, places.index(genes.index(name))]
            columns[name] = TableColumn(name, column[kept], None)
    reading = read_stored_texts(plain)
    read_again = {column.name: column for column in reading.columns}
    held = [str(value) for value, keep in zip(keys, kept, strict=True) if keep]
    made = tuple(read_again.get(column.name, column) for column in columns.values())
    return Table(where, chosen, keys_of(where, chosen, held), made, left_out, reading.notes)


def _found(group: Node, name: str) -> Node:
    node = group.find(name)
    if node is None:
        raise KeyError(clean(name)[:60])
    return node


def _about(root: Node) -> dict[str, str]:
    """Return the columns that link rows to label maps: `region_key` and `instance_key`."""
    uns = root.find("uns")
    held = uns.find(_ATTRIBUTES) if uns is not None and uns.shape is None else None
    found = {}
    for name in ("region_key", "instance_key"):
        node = held.find(name) if held is not None else None
        if node is not None and node.shape == ():
            found[name] = str(node.read(())[()])
    return found


def _index(frame: Node, where: str) -> list[str]:
    name = str(frame.attribute("_index") or "_index")
    return [str(value) for value in _series(_found(frame, name), f"{where}: var/{name:.60}")]


def _series(node: Node, where: str) -> list[Any]:
    """Return the values of one column; None: a missing value."""
    kind = str(node.attribute("encoding-type") or "")
    if kind == "categorical":
        categories = _series(_found(node, "categories"), where)
        codes = _values(_found(node, "codes"), where).tolist()
        if not all(-1 <= code < len(categories) for code in codes):
            raise SourceError(
                f"{where}: found codes {min(codes)} to {max(codes)}, expected -1 to "
                f"{len(categories) - 1}: there are {len(categories)} categories"
            )
        return [None if code < 0 else categories[code] for code in codes]
    if kind.startswith("nullable"):
        values = _values(_found(node, "values"), where).tolist()
        masked = _values(_found(node, "mask"), where).tolist()
        return [None if no else v for v, no in zip(values, masked, strict=True)]
    return list(_values(node, where).tolist())


def _values(node: Node, where: str) -> NDArray[Any]:
    if node.shape is None or len(node.shape) != 1 or node.shape[0] > MAX_ROWS:
        found = "a group" if node.shape is None else f"an array of {_by(node.shape)} values"
        raise SourceError(f"{where}: found {found}, expected a list of at most {MAX_ROWS}")
    return node.read(...)


def _require_rows(where: str, name: str, values: list[Any], rows: int) -> None:
    if len(values) != rows:
        raise SourceError(
            f"{where}: obs/{clean(name):.60}: found {len(values)} values, expected {rows}"
        )


def _column(name: str, values: list[Any], kept: NDArray[np.bool_]) -> TableColumn:
    values = [value for value, keep in zip(values, kept, strict=True) if keep]
    if all(value is None or isinstance(value, bool | int | float) for value in values):
        numbers = [np.nan if value is None else number_of(value) for value in values]
        return TableColumn(name, np.array(numbers, np.float64), None)
    texts = ("" if value is None else clean(str(value)) for value in values)
    return TableColumn(name, None, tuple(texts))


def _columns_of(
    matrix: Node, where: str, size: tuple[int, int], places: list[int]
) -> NDArray[np.float64]:
    """Return some columns of X, dense or sparse: float64 (rows, columns)."""
    rows, genes = size
    if rows * len(places) > _MAX_VALUES:
        raise SourceError(
            f"{where}: X: found {rows} rows by {len(places)} columns, expected at most "
            f"{_MAX_VALUES} values: choose columns with --columns"
        )
    stated = matrix.shape if matrix.shape is not None else matrix.attribute("shape")
    if stated is None or tuple(stated) != size:
        found = "no shape" if stated is None else f"{_by(stated)} values"
        raise SourceError(f"{where}: X: found {found}, expected {_by(size)}, the sizes of obs, var")
    made = np.zeros((rows, len(places)))
    if matrix.shape is not None:
        step = max(1, _BLOCK // max(genes, 1))
        for start in range(0, rows, step):
            made[start : start + step] = matrix.read(slice(start, start + step))[:, places]
        return made
    kind = str(matrix.attribute("encoding-type"))
    if kind not in ("csr_matrix", "csc_matrix"):
        raise SourceError(f"{where}: X: found {kind:.40}, expected csr_matrix or csc_matrix")
    _fill(made, matrix, where, genes, places, by_row=kind == "csr_matrix")
    return made


def _fill(
    made: NDArray[np.float64],
    matrix: Node,
    where: str,
    genes: int,
    places: list[int],
    *,
    by_row: bool,
) -> None:
    """Copy a sparse matrix's values for some columns to their places in a dense array.

    by_row  True for CSR: `indptr` counts rows and `indices` are columns; False for CSC: the reverse
    """
    data, indices, pointer = (_found(matrix, name) for name in ("data", "indices", "indptr"))
    lines = len(made) if by_row else genes
    if pointer.shape != (lines + 1,) or data.shape is None or data.shape != indices.shape:
        raise SourceError(
            f"{where}: X: found parts whose lengths don't fit, expected those of a sparse matrix"
        )
    begins = np.asarray(pointer.read(...), np.int64)
    count = data.shape[0]
    if begins[0] != 0 or begins[-1] != count or (np.diff(begins) < 0).any():
        raise SourceError(
            f"{where}: X/indptr: found numbers that don't rise from 0 to {count}, expected those "
            "of a sparse matrix"
        )
    column = np.full(genes, -1)
    column[places] = np.arange(len(places))
    for start in range(0, count, _BLOCK):
        part = slice(start, min(start + _BLOCK, count))
        across = np.asarray(indices.read(part), np.int64)
        along = np.searchsorted(begins, np.arange(part.start, part.stop), side="right") - 1
        row, gene = (along, across) if by_row else (across, along)
        if len(across) and not 0 <= across.min() <= across.max() < (genes if by_row else len(made)):
            raise SourceError(f"{where}: X/indices: found {across.max()}, beyond the matrix")
        at = column[gene]
        wanted = at >= 0
        made[row[wanted], at[wanted]] = np.asarray(data.read(part), np.float64)[wanted]


def _by(numbers: Any) -> str:
    return " x ".join(str(int(n)) for n in numbers) or "one"
