"""Read variable-length text attributes of HDF5 in a child process with a time limit.

Variable-length texts lie in heaps, and libhdf5 loops without end over some damaged heaps. It does
so in C and holds Python's lock, so no signal can end it. Other attributes lie in the object itself.
"""

from typing import Any

import h5py

from stereocell.storage.child_process import Bounds, Child
from stereocell.storage.open_hdf5 import OpenHdf5

_MOST_S = 30.0  # seconds for one attribute; starting a child takes 0.2 s of CPU, an attribute 1 ms
_PLAIN = (h5py.h5t.TypeFloatID, h5py.h5t.TypeIntegerID, h5py.h5t.TypeEnumID)


class HeapTexts:
    """Reads attributes of a source's files. The first such text of a file starts its child."""

    def __init__(self) -> None:
        self._children: dict[str, Child] = {}

    def read(self, node: h5py.Group | h5py.Dataset, name: str) -> Any:
        """Return an attribute. Raises h5py's errors and ChildError."""
        return self._child(node).call("attribute", str(node.name), name)

    def scales(self, dataset: h5py.Dataset) -> list[list[str]]:
        """Return the paths of a dataset's dimension scales, one list per dimension.

        References to the scales lie in a heap. Raises h5py's errors and ChildError.
        """
        found: list[list[str]] = self._child(dataset).call("scales", str(dataset.name))
        return found

    def _child(self, node: h5py.Group | h5py.Dataset) -> Child:
        path = str(node.file.filename)
        if path not in self._children:
            self._children[path] = Child(OpenHdf5, path, bounds=Bounds(_MOST_S))
        return self._children[path]

    def close(self) -> None:
        """End the children. A later read starts a new one."""
        for child in self._children.values():
            child.close()
        self._children.clear()


def lies_in_heap(stored: h5py.h5t.TypeID) -> bool:
    """Return whether values of a type lie in a heap and not in the attribute or dataset itself."""
    if isinstance(stored, h5py.h5t.TypeStringID):
        return bool(stored.is_variable_str())
    return not isinstance(stored, _PLAIN)
