"""Open AnnData tables in a Zarr store or in an HDF5 file (.h5ad).

libhdf5 loops without end over some damaged heaps of texts. It does so in C and holds Python's lock,
so no signal can end it. A .h5ad file holds such heaps, so a child process reads it
(storage/child_process.py).
"""

import math
from typing import Any

import h5py
import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.abc.store import Store

from stereocell.model.errors import SourceError
from stereocell.read.formats.ome_zarr.store import (
    GuardedStore,
    open_array,
    open_store,
    zarr_boundary,
)
from stereocell.read.hdf5_file.chunks import ChunkIndex
from stereocell.read.hdf5_file.tree import Hdf5Tree, require_readable
from stereocell.read.tables.anndata import read_anndata
from stereocell.read.tables.table import Table
from stereocell.storage.child_process import Bounds, run_in_child
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_EXPECTED = "a table of AnnData (obs, var, X)"
_MOST_S = 300.0  # s; time limit for a table in HDF5. A million rows take less than a tenth of it
_TEXT_BYTES = 1024  # bytes of a text, on average within its chunk
_LARGEST_CHUNK = 1 << 28  # bytes; an array with larger chunks is refused
_LONGEST_TEXT = 4096  # bytes; an array of longer fixed-length texts is refused


def read_anndata_zarr(location: Location, key: str, wanted: tuple[str, ...], labels: str) -> Table:
    """Return an AnnData table in Zarr. Raises SourceError."""
    where = location.shown
    with zarr_boundary(where, _EXPECTED):
        store = open_store(location)
        root = zarr.open_group(GuardedStore(store, location), mode="r")
        return read_anndata(_ZarrNode(location, store, root), where, key, wanted, labels)


def read_h5ad(location: Location, key: str, wanted: tuple[str, ...], labels: str) -> Table:
    """Return an AnnData table in HDF5. Raises SourceError."""
    with one_line(location.shown, _EXPECTED):
        table: Table = run_in_child(
            _read_h5ad, location, key, wanted, labels, bounds=Bounds(_MOST_S)
        )
    return table


def _read_h5ad(location: Location, key: str, wanted: tuple[str, ...], labels: str) -> Table:
    where = location.shown
    tree = Hdf5Tree(location, _EXPECTED)
    try:
        with one_line(where, _EXPECTED):
            return read_anndata(_Hdf5Node(tree, tree.root), where, key, wanted, labels)
    finally:
        tree.close()


class _ZarrNode:
    def __init__(self, location: Location, store: Store, node: Any) -> None:
        self._location, self._store, self._node = location, store, node
        self.shape: tuple[int, ...] | None = None
        if isinstance(node, zarr.Array):
            self.shape = node.shape

    def attribute(self, name: str) -> Any:
        return self._node.attrs.get(name)

    def find(self, name: str) -> "_ZarrNode | None":
        found = self._node.get(name) if isinstance(self._node, zarr.Group) else None
        return None if found is None else _ZarrNode(self._location, self._store, found)

    def read(self, key: Any) -> NDArray[Any]:
        is_text = self._node.dtype.kind in "OTU"
        size = _TEXT_BYTES if is_text else None
        array: Any = open_array(
            self._location, self._store, self._node.path, title="array", item_bytes=size
        )
        values = np.asarray(array[key])
        return values.astype(object) if is_text else values


class _Hdf5Node:
    def __init__(self, tree: Hdf5Tree, node: h5py.Group | h5py.Dataset) -> None:
        self._tree, self._node = tree, node
        self._is_sound = False
        self.shape: tuple[int, ...] | None = None
        if isinstance(node, h5py.Dataset):
            self.shape = node.shape

    def attribute(self, name: str) -> Any:
        value = self._node.attrs.get(name)
        return value.decode("utf-8", "replace") if isinstance(value, bytes) else value

    def find(self, name: str) -> "_Hdf5Node | None":
        if not isinstance(self._node, h5py.Group) or name not in self._node:
            return None
        return _Hdf5Node(self._tree, self._tree.find(name, start=self._node))

    def read(self, key: Any) -> NDArray[Any]:
        where = f"{self._tree.where}:{self._node.name}"
        require_readable(self._node, where)
        item = self._node.dtype.itemsize
        if self._node.dtype.kind == "V" or item > _LONGEST_TEXT:
            found = "records" if self._node.dtype.kind == "V" else f"values of {item} bytes"
            raise SourceError(f"{where}: found {found}, expected numbers or texts")
        if item * math.prod(self._node.chunks or ()) > _LARGEST_CHUNK:
            raise SourceError(
                f"{where}: found a chunk of over {_LARGEST_CHUNK} bytes, expected a smaller one"
            )
        if not self._is_sound:
            ChunkIndex(self._node, where).require_found()
            self._is_sound = True
        is_text = h5py.check_string_dtype(self._node.dtype) is not None
        stored = self._node.asstr(errors="replace") if is_text else self._node
        return np.asarray(stored[key])
