"""Read MRC and CCP4 maps (.mrc, .rec, .map), plain or compressed, with headers from mrcfile.

The voxel size is in Angstrom. Columns, rows and sections lie along any axes (MAPC, MAPR, MAPS). The
first row is the lowest: y grows upwards, and the axes are right-handed. So y is reversed, as in
images that IMOD writes, and a molecule keeps its handedness. Labels are free text, not read.

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
from stereocell.read.file_array import FileArray, PackedArray, notes_on_rest, unpack_array
from stereocell.read.flipped_array import FlippedArray
from stereocell.read.formats.mrc.statements import (
    STACK_OF_VOLUMES,
    angle_notes,
    settle_order,
    settle_sign,
    settle_spacing,
    volumes_of,
)
from stereocell.read.image import Image
from stereocell.read.spacing import Grid
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_HEADER = 1024  # bytes; an extended header of `nsymbt` bytes follows
_MAGIC = {b"\x1f\x8b": "gzip", b"BZ": "bzip2"}


def read_image(location: Location) -> Image:
    """Return the volume of the file. Raises SourceError where it can't be read."""
    where = location.shown
    path = os.path.realpath(location.path)
    with one_line(where, "an MRC or CCP4 file"):
        header, packing, extended = _header(path)
        dtype = data_dtype_from_header(header)
        shape = tuple(int(header[name]) for name in ("nz", "ny", "nx"))
        order, order_notes = settle_order(header)
        offset = _HEADER + int(header["nsymbt"])
    if min(shape) < 1 or offset < _HEADER:
        raise SourceError(
            f"{where}: size (z, y, x): found {shape}, expected at least one voxel along each axis"
        )
    if dtype.kind == "c":
        raise SourceError(
            f"{where}: mode: found {int(header['mode'])} (complex), expected real numbers"
        )
    if sorted(order) != [1, 2, 3]:
        raise SourceError(f"{where}: MAPS, MAPR, MAPC: found {order}, expected 1, 2 and 3")
    group, sampling = int(header["ispg"]), int(header["mz"])
    count = volumes_of(header)
    is_stack = count == 1 and (group == STACK_OF_VOLUMES or (group == 0 and sampling == 1))
    kind = {STACK_OF_VOLUMES: "volumes"}.get(group, "images")
    notes = [f"the header states a stack of {kind}: read as one volume"] if is_stack else []
    if count > 1:
        notes.append(
            f"the header states a stack of {count} volumes of {sampling} sections (mz): --time "
            "counts them"
        )
        shape = (count, sampling, *shape[1:])
    if dtype.itemsize == 1:
        is_signed, sign_notes = settle_sign(header)
        dtype = np.dtype(np.int8 if is_signed else np.uint8)
        notes += sign_notes
    spacing, spacing_notes = settle_spacing(header, extended, is_stack=is_stack)
    notes += [*order_notes, *spacing_notes, *angle_notes(header)]
    array: StoredArray
    if packing:
        array = PackedArray(
            shape, dtype, partial(unpack_array, path, shape, dtype, packing, 0, skip=offset)
        )
    else:
        array = FileArray(path, shape, dtype, offset, where)
    notes += notes_on_rest(array)
    axes = tuple("xyz"[axis - 1] for axis in order)
    axes = ("t", *axes) if count > 1 else axes
    voxels = VoxelArray(FlippedArray(array, [axis == "y" for axis in axes]), axes)
    grid = Grid(voxels.shape, spacing)
    return Image((voxels,), (grid,), (None,), (None,), 1, notes=tuple(notes))


def _header(path: str) -> tuple[Any, str, Any]:
    """Return the header, how the file is compressed, and the extended header; None: it has none.

    Raises ValueError where the file isn't MRC.
    """
    with open(path, "rb") as file:
        packing = _MAGIC.get(file.read(2), "")
    if not packing and (size := os.path.getsize(path)) < _HEADER:
        raise ValueError(f"cut short at byte {size}: a header has {_HEADER} bytes")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # warnings about faults that don't prevent reading
        with mrcfile.open(path, permissive=True, header_only=True) as opened:
            header, extended = opened.header, opened.extended_header
    if header is None or not (bytes(header["map"]).startswith(b"MAP") or _has_size(path, header)):
        raise ValueError("no `MAP ` at byte 208")
    return header, packing, extended


def _has_size(path: str, header: Any) -> bool:
    """Return whether a file's size agrees with its header, since files before 2000 have no mark."""
    count = math.prod(int(header[name]) for name in ("nx", "ny", "nz"))
    expected = _HEADER + int(header["nsymbt"]) + count * data_dtype_from_header(header).itemsize
    return count > 0 and os.path.getsize(path) == expected
