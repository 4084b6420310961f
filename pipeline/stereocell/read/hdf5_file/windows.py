"""Read windows of HDF5 datasets that need filters of hdf5plugin in a child process."""

from threading import Lock
from typing import Any
from weakref import WeakValueDictionary

import h5py
from numpy.typing import NDArray

from stereocell.storage.child_process import Child

_children: WeakValueDictionary[str, Child] = WeakValueDictionary()  # one for each open file
_lock = Lock()


class PluginWindows:
    """A dataset's voxels. The first window starts the child; it ends with the file's last user."""

    def __init__(self, dataset: h5py.Dataset) -> None:
        self._path, self._name = str(dataset.file.filename), str(dataset.name)
        self._child: Child | None = None

    def __getitem__(self, key: Any) -> Any:
        """Return voxels. Raises h5py's errors and ChildError."""
        with _lock:
            self._child = self._child or _children.get(self._path) or Child(_OpenFile, self._path)
            _children[self._path] = self._child
        return self._child.call("window", self._name, key)


class _OpenFile:
    """An open HDF5 file in the child process."""

    def __init__(self, path: str) -> None:
        has_plugins()
        self._file = h5py.File(path, "r", locking="best-effort")

    def window(self, name: str, key: Any) -> NDArray[Any]:
        found: NDArray[Any] = self._file[name][key]
        return found


def has_plugins() -> bool:
    """Register the filters of hdf5plugin. Returns False if it isn't installed."""
    try:
        import hdf5plugin  # noqa: F401
    except ImportError:
        return False
    return True
