"""MRC and CCP4 maps (.mrc, .rec, .map), plain or packed by gzip or bzip2; mrcfile reads the header.

The voxel size is in Angstrom. Columns, rows and sections lie along any axes (MAPC, MAPR, MAPS). The
first row is the lowest: y grows upwards and the axes are right-handed. So y is turned round, as in
pictures that IMOD writes, and a molecule keeps its hand. The labels are free text and are not read.

References: https://www.ccpem.ac.uk/mrc-format/mrc2014/, and IMOD's `imodStamp` for signed bytes.
"""

import math
import os
import warnings
from functools import partial
from typing import Any

import mrcfile
import numpy as np
from mrcfile.utils import data_dtype_from_header

from stereocell.model.errors import SourceError
from stereocell.read.dataset import StoredArray, VoxelArray
from stereocell.read.file_array import FileArray, FlippedArray, PackedArray, unpack_array
from stereocell.read.image import Image
from stereocell.read.spacing import Grid, Triple
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location, require_file

_UM_PER_ANGSTROM = 1e-4
_HEADER = 1024  # bytes; an extended header of `nsymbt` follows
_MAGIC = {b"\x1f\x8b": "gzip", b"BZ": "bzip2"}
_IMOD_STAMP = 1146047817
_SIGNED = 1  # bit of IMOD's flags
_STACK_OF_VOLUMES = 401  # space group


def read_image(location: Location) -> Image:
    """Return the volume of the file. Raises SourceError where it can't be read."""
    where = location.shown
    require_file(location)
    path = os.path.realpath(location.path)
    with one_line(where, "an MRC or CCP4 file"):
        header, packing = _header(path)
        dtype = data_dtype_from_header(header)
        shape = tuple(int(header[name]) for name in ("nz", "ny", "nx"))
        order = [int(header[name]) for name in ("maps", "mapr", "mapc")]
        offset = _HEADER + int(header["nsymbt"])
    if min(shape) < 1 or offset < _HEADER:
        raise SourceError(f"{where}: size (z, y, x): found {shape}, expected voxels")
    if dtype.kind == "c":
        raise SourceError(f"{where}: mode: found {int(header['mode'])} (complex), expected numbers")
    if order == [0, 0, 0]:
        order = [3, 2, 1]  # writers that leave it out
    if sorted(order) != [1, 2, 3]:
        raise SourceError(f"{where}: MAPS, MAPR, MAPC: found {order}, expected 1, 2 and 3")
    group, sampling = int(header["ispg"]), int(header["mz"])
    kind = {_STACK_OF_VOLUMES: "volumes"}.get(group, "images")
    is_stack = group == _STACK_OF_VOLUMES or (group == 0 and sampling == 1)
    note = (f"the header says a stack of {kind}: taken for one volume",) if is_stack else ()
    if dtype.itemsize == 1 and not _is_signed(header):
        dtype = np.dtype(np.uint8)
    array: StoredArray
    if packing:
        array = PackedArray(
            shape, dtype, partial(unpack_array, path, shape, dtype, packing, 0, skip=offset)
        )
    else:
        array = FileArray(path, shape, dtype, offset, where)
    axes = tuple("xyz"[axis - 1] for axis in order)
    voxels = VoxelArray(FlippedArray(array, [axis == "y" for axis in axes]), axes)
    return Image(
        (voxels,), (Grid(voxels.shape, _spacing(header)),), (None,), (None,), 1, notes=note
    )


def _header(path: str) -> tuple[Any, str]:
    """Return the header, and how the file is packed. Raises ValueError where it isn't MRC."""
    with open(path, "rb") as file:
        packing = _MAGIC.get(file.read(2), "")
    if not packing and (size := os.path.getsize(path)) < _HEADER:
        raise ValueError(f"cut short at byte {size}: a header has {_HEADER}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # on what permits reading all the same
        with mrcfile.open(path, permissive=True, header_only=True) as opened:
            header = opened.header
    if header is None or not (bytes(header["map"]).startswith(b"MAP") or _has_size(path, header)):
        raise ValueError("no `MAP ` at byte 208")
    return header, packing


def _has_size(path: str, header: Any) -> bool:
    """Whether a file has the size that its header tells: the format before 2000 has no mark."""
    count = math.prod(int(header[name]) for name in ("nx", "ny", "nz"))
    expected = _HEADER + int(header["nsymbt"]) + count * data_dtype_from_header(header).itemsize
    return count > 0 and os.path.getsize(path) == expected


def _is_signed(header: Any) -> bool:
    """Whether bytes have a sign: mode 0 does in MRC2014, and in IMOD's files where a flag says so.

    IMOD's stamp and flags are two 32-bit numbers in MRC2014's `extra2`, at bytes 152 and 156.
    """
    raw = header.tobytes()
    order = header.dtype["nx"].str[0].replace("|", "=")
    stamp, flags = np.frombuffer(raw[152:160], np.dtype(np.int32).newbyteorder(order))
    return int(stamp) != _IMOD_STAMP or bool(int(flags) & _SIGNED)


def _spacing(header: Any) -> Triple | None:
    """Return the spacing (z, y, x), um; None: the header tells no cell or no sampling of it."""
    cell = [float(header["cella"][axis]) for axis in "zyx"]
    counts = [int(header[name]) for name in ("mz", "my", "mx")]
    if min(counts) < 1 or min(cell) <= 0:
        return None
    z, y, x = (c / n * _UM_PER_ANGSTROM for c, n in zip(cell, counts, strict=True))
    return z, y, x
