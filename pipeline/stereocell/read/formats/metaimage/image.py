"""Read MetaImage: .mha, and .mhd with its voxels in a file beside it.

The header is lines of `Key = value`. Only a short list of keys is read (fields.py), since others
may identify a patient. As in ITK, `Offset` and the rows of `TransformMatrix` are in LPS, in mm
unless `DistanceUnits` states otherwise, and `AnatomicalOrientation` changes nothing. SimpleITK
(50 MB) reads the format too, but opens a file of voxels anywhere on the machine; the tests compare
with it.

References: https://itk.org/Wiki/ITK/MetaIO/Documentation
"""

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from stereocell.model.errors import SourceError
from stereocell.read.dataset import StoredArray
from stereocell.read.file_array import FileArray, PackedArray, notes_on_rest, unpack_array
from stereocell.read.formats.metaimage.fields import (
    NAME,
    Header,
    integers,
    modality_of,
    numbers,
    read_header,
    require_dimensions,
    scale_notes,
    side_notes,
    unit_mm,
    value_notes,
)
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.patient_grid import place, settle_origin
from stereocell.read.plausible_size import size_notes
from stereocell.storage.location import Location, require_own

_TYPES = {
    "MET_CHAR": "i1", "MET_UCHAR": "u1", "MET_SHORT": "i2", "MET_USHORT": "u2",
    "MET_INT": "i4", "MET_UINT": "u4", "MET_LONG": "i4", "MET_ULONG": "u4",
    "MET_LONG_LONG": "i8", "MET_ULONG_LONG": "u8", "MET_FLOAT": "f4", "MET_DOUBLE": "f8",
}  # fmt: skip


def read_image(location: Location) -> Image:
    """Return the image of the file, with all its time points. Raises SourceError."""
    where = location.shown
    header = read_header(location)
    fields, end = header.fields, header.end
    shape = integers(where, fields, "DimSize")
    if len(shape) not in (3, 4) or min(shape) < 1:
        raise SourceError(
            f"{where}: DimSize: found {fields.get('DimSize', 'none'):.60}, expected three sizes "
            "x, y, z, or four with time (a volume needs at least 2 planes)"
        )
    require_dimensions(where, fields, len(shape))
    samples = integers(where, fields, "ElementNumberOfChannels") or [1]
    if len(samples) != 1 or not 0 < samples[0] <= MAX_CHANNELS:
        raise SourceError(
            f"{where}: ElementNumberOfChannels: found {samples}, expected 1 to {MAX_CHANNELS}"
        )
    array = _array(location, fields, end, (*reversed(shape), samples[0]))
    axes = ("t", "k", "j", "i", "c") if len(shape) == 4 else ("k", "j", "i", "c")
    affine, notes = _affine(where, header, shape)
    notes = (*notes, *notes_on_rest(array))
    image = place(where, array, axes, affine, "TransformMatrix").image(
        NAME, notes=notes, has_sides="TransformMatrix" in fields
    )
    beside = fields["ElementDataFile"]
    folder = os.path.dirname(os.path.realpath(location.path))
    voxels = () if beside.upper() == "LOCAL" else (os.path.join(folder, beside),)
    return replace(image, files=(location.path, *voxels), modality=modality_of(fields))


def _array(
    location: Location, fields: dict[str, str], end: int, shape: tuple[int, ...]
) -> StoredArray:
    """Return the voxels, which follow the header or lie in a file beside it."""
    where, stated = location.shown, fields.get("ElementType", "")
    kind = _TYPES.get(stated.removesuffix("_ARRAY"))
    if kind is None:
        raise SourceError(
            f"{where}: ElementType: found {stated or 'none':.40}, expected one of "
            f"{', '.join(_TYPES)}"
        )
    if not _flag(fields, "BinaryData", True):
        raise SourceError(
            f"{where}: BinaryData: found False (text), expected True: save it again as binary"
        )
    dtype = np.dtype((">" if _flag(fields, "BinaryDataByteOrderMSB", False) else "<") + kind)
    named = fields["ElementDataFile"]
    path = os.path.realpath(location.path)
    if named.upper() != "LOCAL":
        if named.upper().startswith("LIST") or "%" in named:
            raise SourceError(
                f"{where}: ElementDataFile: found a list of files, expected one: save it again as "
                ".mha"
            )
        path, end = os.path.join(os.path.dirname(path), named), 0
        field = f"{where}: ElementDataFile {named!r:.200}"
        require_own(path, [location.folder], named=field)
        if not Path(path).is_file():
            raise SourceError(f"{field}: not found, expected the voxels beside the header")
        where = field
    if _flag(fields, "CompressedData", False):
        load = partial(unpack_array, path, shape, dtype, "zlib", end)
        return PackedArray(shape, dtype, load)
    skip = (integers(location.shown, fields, "HeaderSize") or [0])[0]
    if skip < 0:  # the voxels are then the last bytes of the file
        skip = max(0, os.path.getsize(path) - math.prod(shape) * dtype.itemsize)
        end = 0
    return FileArray(path, shape, dtype, end + skip, where)


def _affine(
    where: str, header: Header, shape: Sequence[int]
) -> tuple[np.ndarray[tuple[int, int], np.dtype[np.float64]], tuple[str, ...]]:
    """Return the affine (4, 4) to LPS in mm, and notes."""
    n, fields = len(shape), header.fields
    spacing = numbers(where, fields, "ElementSpacing", n)
    matrix = numbers(where, fields, "TransformMatrix", n * n)
    if spacing is None:
        raise SourceError(
            f"{where}: ElementSpacing: not found, expected {n} lengths in mm: add it to the header"
        )
    turned = np.eye(n) if matrix is None else np.array(matrix).reshape(n, n)
    affine = np.eye(4)
    # a row of the matrix for each axis of the image
    affine[:3, :3] = turned[:3, :3].T * np.array(spacing[:3])
    affine[:3, 3], origin_notes = settle_origin("Offset", numbers(where, fields, "Offset", n))
    per, unit_notes = unit_mm(fields)
    affine[:3] *= per
    lengths = np.linalg.norm(affine[:3, :3], axis=0)
    axes = turned[:3, :3].T
    notes = [*header.notes, *unit_notes, *side_notes(fields, axes)]
    # without a matrix the image is not placed in a patient
    notes += origin_notes if matrix is not None else ()
    notes += scale_notes(spacing[:3], axes, per)
    return affine, (*notes, *value_notes(where, fields), *size_notes(lengths.tolist(), shape[:3]))


def _flag(fields: dict[str, str], name: str, default: bool) -> bool:
    text = fields.get(name, "").lower()
    return text[:1] in ("t", "1", "y") if text else default
