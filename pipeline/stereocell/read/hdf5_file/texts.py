"""Read HDF5's attributes of variable-length text in a child process with a time limit.

Such texts lie in heaps. libhdf5 loops without end over some damaged heaps. It does so in C and
holds Python's lock, so no signal can end it. Other attributes lie in the object itself.
"""

from typing import Any

import h5py

from stereocell.storage.child_process import Bounds, Child
from stereocell.storage.open_hdf5 import OpenHdf5

_MOST_S = 30.0  # seconds for one attribute; to start a child takes 0.2 s of CPU, an attribute 1 ms
_PLAIN = (h5py.h5t.TypeFloatID, h5py.h5t.TypeIntegerID, h5py.h5t.TypeEnumID)


class HeapTexts:
    """Reads attributes of the files of a source. A file's child starts with its first such text."""

    def __init__(self) -> None:
        self._children: dict[str, Child] = {}

    def read(self, node: h5py.Group | h5py.Dataset, name: str) -> Any:
        """Return an attribute. Raises h5py's errors, ChildError."""
        return self._child(node).call("attribute", str(node.name), name)

    def scales(self, dataset: h5py.Dataset) -> list[list[str]]:
        """Return the paths of a dataset's dimension scales, a list for each dimension.

        The references to them lie in a heap. Raises h5py's errors, ChildError.
        """
        found: list[list[str]] = self._child(dataset).call("scales", str(dataset.name))
        return found

    def _child(self, node: h5py.Group | h5py.Dataset) -> Child:
        path = str(node.file.filename)
        if path not in self._children:
            self._children[path] = Child(OpenHdf5, path, bounds=Bounds(_MOST_S))
        return self._children[path]

    def close(self) -> None:
        """End the children; a later read starts another one."""
        for child in self._children.values():
            child.close()
        self._children.clear()


def lies_in_heap(stored: h5py.h5t.TypeID) -> bool:
    """Return whether values of a type lie in a heap, not in the attribute or dataset itself."""
    if isinstance(stored, h5py.h5t.TypeStringID):
        return bool(stored.is_variable_str())
    return not isinstance(stored, _PLAIN)
