"""AnnData's tables in Zarr, by zarr alone: `obs`, and `X` by the names of `var`.

A SpatialData store holds them below `tables/`. Its own library would bring 60 others.

References
AnnData's on-disk format, https://anndata.readthedocs.io/en/latest/fileformat-prose.html
SpatialData's design document, https://spatialdata.scverse.org/
"""

from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from scipy import sparse

from stereocell.model.errors import SourceError
from stereocell.read.tables.table import (
    Table,
    TableColumn,
    choose_columns,
    choose_key,
    clean,
    keys_of,
    named,
)
from stereocell.read.zarr_store import GuardedStore, open_store, quiet
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_ATTRIBUTES = "spatialdata_attrs"  # in `uns`: which label map the rows belong to
_MOST_VALUES = 400_000_000  # of X


def read_anndata(location: Location, key: str, wanted: tuple[str, ...], labels: str) -> Table:
    """Return a table of AnnData; of several label maps' rows those of one. Raises SourceError."""
    where = location.shown
    with quiet(), one_line(where, "a table of AnnData in Zarr (obs, var, X)"):
        group: Any = zarr.open_group(GuardedStore(open_store(location), location), mode="r")
        if "obs" not in group:
            raise SourceError(f"{where}: found no `obs`, expected a table of AnnData")
        obs = group["obs"]
        names = [str(name) for name in obs.attrs.get("column-order", [])]
        about = _about(group)
        chosen = key or (str(about["instance_key"]) if about.get("instance_key") in names else "")
        chosen = choose_key(where, names, chosen)
        kept = np.ones(len(_series(obs[chosen])), bool)
        if about.get("region_key") in names:
            regions = _series(obs[str(about["region_key"])])
            kept = np.array([str(region) == labels for region in regions])
            if not kept.any():
                found = ", ".join(sorted({str(region) for region in regions})[:8])
                raise SourceError(f"{where}: rows of {found}, expected some of {labels}")
        genes = named(_index(group["var"])) if "X" in group else []
        own = [name for name in names if name not in (chosen, about.get("region_key"))]
        every = list(dict.fromkeys([*own, *genes]))
        taken, left_out = choose_columns(where, every, chosen, wanted)
        numbers = _matrix(where, group["X"]) if any(name in genes for name in taken) else None
        columns = []
        for name in taken:
            if name in own:
                columns.append(_column(clean(name) or "column", _series(obs[name]), kept))
            elif numbers is not None:
                place = genes.index(name)
                column = numbers[:, [place]]
                dense = column if isinstance(column, np.ndarray) else column.toarray()
                columns.append(TableColumn(name, np.asarray(dense, np.float64).ravel()[kept], None))
        keys = _series(obs[chosen])
    held = [value for value, keep in zip(keys, kept, strict=True) if keep]
    return Table(
        where, chosen, keys_of(where, chosen, [str(v) for v in held]), tuple(columns), left_out
    )


def _about(group: Any) -> dict[str, Any]:
    """Return which label map a table says it belongs to: `region_key`, `instance_key`."""
    uns = group.get("uns")
    held = uns.get(_ATTRIBUTES) if uns is not None else None
    found: dict[str, Any] = {}
    for name in ("region_key", "instance_key"):
        value = held.get(name) if held is not None else None
        if value is not None and not isinstance(value, zarr.Group):
            found[name] = str(value[()])
    return found


def _index(frame: Any) -> list[str]:
    return [str(name) for name in _series(frame[str(frame.attrs.get("_index", "_index"))])]


def _series(node: Any) -> list[Any]:
    """Return the values of one column; None: missing."""
    kind = node.attrs.get("encoding-type", "")
    if kind == "categorical":
        categories = _series(node["categories"])
        return [None if code < 0 else categories[code] for code in node["codes"][:].tolist()]
    if str(kind).startswith("nullable"):
        masked = node["mask"][:].tolist()
        return [None if no else v for v, no in zip(node["values"][:].tolist(), masked, strict=True)]
    return list(node[...].tolist())


def _column(name: str, values: list[Any], kept: NDArray[np.bool_]) -> TableColumn:
    values = [value for value, keep in zip(values, kept, strict=True) if keep]
    if all(value is None or isinstance(value, bool | int | float) for value in values):
        numbers = [np.nan if value is None else float(value) for value in values]
        return TableColumn(name, np.array(numbers, np.float64), None)
    return TableColumn(name, None, tuple("" if value is None else str(value) for value in values))


def _matrix(where: str, node: Any) -> Any:
    """Return X, dense or sparse, (rows, genes)."""
    kind = node.attrs.get("encoding-type", "")
    if kind in ("csr_matrix", "csc_matrix"):
        made = sparse.csr_matrix if kind == "csr_matrix" else sparse.csc_matrix
        parts = (node["data"][:], node["indices"][:], node["indptr"][:])
        return made(parts, shape=tuple(node.attrs["shape"])).tocsc()
    if node.size > _MOST_VALUES:
        raise SourceError(f"{where}: X: found {node.size} values, expected at most {_MOST_VALUES}")
    return np.asarray(node[...])
