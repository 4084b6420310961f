"""Read NumPy's .npy: one array, a window at a time.

The file states no axes and no spacing. An array of Fortran order is read as an array of C order
with its axes reversed.

References: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
"""

import os
from typing import Any

import numpy as np

from stereocell.model.errors import SourceError
from stereocell.read.array_axes import settle_stated_axes
from stereocell.read.dataset import VoxelArray
from stereocell.read.format import Format, Guide
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.spacing import Grid
from stereocell.read.statements import Statement, Trust
from stereocell.storage.first_bytes import Mark
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_USUAL = {3: ("z", "y", "x"), 4: ("c", "z", "y", "x")}  # usual axes by the number of dimensions
_REFUSED = {"O": "Python objects", "V": "records", "b": "bool, a mask"}  # words by dtype.kind


def _open(location: Location, *, axes: str = "") -> Image:
    """Return the volume of the file. Raises SourceError where it can't be read."""
    # imported here because it imports nibabel
    from stereocell.read.file_array import FileArray, notes_on_rest

    where, path = location.shown, os.path.realpath(location.path)
    with one_line(where, "a complete .npy file"):
        shape, is_fortran, dtype, offset = _header(path)
    if dtype.kind in _REFUSED:
        raise SourceError(
            f"{where}: dtype: found {_REFUSED[dtype.kind]}, expected integers or floats: convert "
            "the array, for example with `array.astype('uint8')`"
        )
    usual = _USUAL.get(len(shape))
    stated = [Statement(usual, "as in most arrays of Python", Trust.ASSUMED)] if usual else []
    names, notes = settle_stated_axes(where, shape, axes, stated)
    if is_fortran:
        shape, names = shape[::-1], names[::-1]
    stored = FileArray(path, shape, dtype, offset, where)
    array = VoxelArray(stored, names)
    channels = array.size("c")
    if channels > MAX_CHANNELS:
        raise SourceError(
            f"{where}: axis c: found {channels} channels, expected at most {MAX_CHANNELS}"
        )
    return Image(
        arrays=(array,),
        grids=(Grid(array.shape),),
        names=(None,) * channels,
        colors=(None,) * channels,
        images=1,
        notes=(*notes, *notes_on_rest(stored)),
    )


def _header(path: str) -> tuple[tuple[int, ...], bool, np.dtype[Any], int]:
    """Return the shape, whether the first axis is the fastest, the dtype, and bytes before voxels.

    Raises ValueError where the file isn't .npy.
    """
    with open(path, "rb") as file:
        version = np.lib.format.read_magic(file)
        if version == (1, 0):
            header = np.lib.format.read_array_header_1_0(file)
        else:  # version 3.0 differs only in the characters allowed in field names
            header = np.lib.format.read_array_header_2_0(file)
        return *header, file.tell()


FORMAT = Format(
    title="NumPy's .npy",
    open=_open,
    has_axes=True,
    endings=(".npy",),
    marks=(Mark("a NumPy array", rb"\x93NUMPY"),),
    guides=(Guide("NumPy", "`NAME.npy`", "three axes are z, y, x and four are c, z, y, x"),),
)
