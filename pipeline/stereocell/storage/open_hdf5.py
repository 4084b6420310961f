"""Open an HDF5 file in a child process (read/hdf5_file/texts.py).

This module is not in `read`, because the imports of `read` would double the start of a child.
"""

from typing import Any

import h5py


class OpenHdf5:
    """An open HDF5 file."""

    def __init__(self, path: str) -> None:
        self._file = h5py.File(path, "r", locking="best-effort")

    def attribute(self, node: str, name: str) -> Any:
        """Return an attribute of a group or dataset. Raises h5py's errors."""
        return self._file[node].attrs[name]

    def scales(self, node: str) -> list[list[str]]:
        """Return the paths of a dataset's dimension scales, a list for each dimension.

        Raises h5py's errors.
        """
        listed = self._file[node].attrs["DIMENSION_LIST"]
        return [[str(self._file[one].name or "") for one in references] for references in listed]
