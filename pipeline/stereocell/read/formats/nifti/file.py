"""Open files of NIfTI, Analyze and FreeSurfer's MGH with nibabel, and read stored voxels."""

import logging
import math
import os
import warnings
import zlib
from typing import Any

import nibabel
import numpy as np
from nibabel.cifti2.cifti2 import Cifti2Image
from nibabel.fileslice import fileslice
from nibabel.freesurfer import mghformat
from nibabel.freesurfer.mghformat import MGHError, MGHHeader
from nibabel.openers import ImageOpener
from numpy.typing import NDArray
from scipy.io.matlab import MatReadError

from stereocell.model.errors import SourceError
from stereocell.read.file_array import rest_note, unpack_array
from stereocell.read.packed_stream import unpack
from stereocell.storage.library_errors import one_line, raise_if_short
from stereocell.storage.location import Location, require_own

MGH_ENDINGS = (".mgh", ".mgz", ".mgh.gz")
_WHOLE = "a complete .nii, .nii.gz, .mgh or .mgz file, or a pair .hdr and .img"
_MGH_HEADER = 90  # bytes before the voxels that MGH defines; the rest is padding
_MAX_OFFSET = 1 << 28  # bytes of header and extensions; gzip must unpack them before the voxels
FAULTS = (
    nibabel.filebasedimages.ImageFileError,
    nibabel.spatialimages.HeaderDataError,
    OSError,
    EOFError,
    ValueError,
    TypeError,
    KeyError,
    ArithmeticError,
    AttributeError,
    MemoryError,
    np.linalg.LinAlgError,
    zlib.error,
    MatReadError,
    MGHError,
)


def open_image(location: Location) -> Any:
    """Return nibabel's image of a file or a pair, without its voxels. Raises SourceError."""
    _require_own_pair(location)
    logging.getLogger("nibabel.global").disabled = True  # its messages quote fields of the header
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if location.path.lower().endswith(MGH_ENDINGS):
                return _open_mgh(location.path)
            image: Any = nibabel.load(location.source, mmap=False)
            if isinstance(image, Cifti2Image):
                raise SourceError(
                    f"{location.shown}: found CIFTI (values on surfaces and in greyordinates), "
                    "expected NIfTI with a volume"
                )
            if not isinstance(image, nibabel.nifti1.Nifti1Pair | nibabel.analyze.AnalyzeImage):
                raise TypeError
            # These reads raise an error for an invalid quaternion, unit or type.
            header: Any = image.header
            image.affine.sum()
            if isinstance(image, nibabel.nifti1.Nifti1Pair):
                header.get_xyzt_units()
            header.get_data_dtype()
            header.get_data_shape()
            stored: Any = image.dataobj
            if not 0 <= stored.offset <= _MAX_OFFSET:
                raise ValueError
            return image
    except FAULTS as error:
        raise_if_short(error, location.shown)
        raise SourceError(f"{location.shown}: {_cause(error)}") from None


def _open_mgh(path: str) -> Any:
    """Return an MGH image. nibabel's own loader would unpack all voxels to read the end."""
    with ImageOpener(path) as file:
        head = file.read(_MGH_HEADER)
    if len(head) < _MGH_HEADER:
        raise EOFError
    library: Any = nibabel
    mgh: Any = mghformat
    header = mgh.MGHHeader(head)
    proxy = library.arrayproxy.ArrayProxy(path, header, mmap=False)
    files = {"image": library.fileholders.FileHolder(filename=path)}
    return mgh.MGHImage(proxy, header.get_affine(), header, file_map=files)


def _cause(error: BaseException) -> str:
    """Return why nibabel can't open a file, with the field and a remedy if they are known."""
    if isinstance(error, nibabel.spatialimages.HeaderDataError) and "intercept" in str(error):
        return f"scl_inter: found no finite number beside scl_slope, expected {_WHOLE}"
    if isinstance(error, ValueError) and "w2 should be positive" in str(error):
        return (
            "quatern_b, quatern_c, quatern_d: found squares whose sum exceeds 1, expected those of "
            "a rotation: set qform_code to 0 to read the voxels with pixdim alone"
        )
    return f"not readable as NIfTI, expected {_WHOLE}"


def _require_own_pair(location: Location) -> None:
    """Raise SourceError where nibabel would open a file beside the source that isn't its own."""
    stem, suffix = os.path.splitext(location.source)
    packed = suffix if suffix.lower() == ".gz" else ""
    stem, suffix = os.path.splitext(stem) if packed else (stem, suffix)
    if suffix.lower() in (".hdr", ".img"):
        for beside in (".hdr", ".img", ".mat", ".HDR", ".IMG", ".MAT"):
            path = stem + beside + ("" if beside.lower() == ".mat" else packed)
            if os.path.lexists(path):
                require_own(path, [location.folder], named=path)


def files_of(image: Any) -> set[str]:
    """Return the paths of the file or the pair, and of SPM's matrix file beside a pair."""
    held = [one.filename for one in image.file_map.values() if one.filename]
    return {name for name in held if os.path.exists(name)}


def require_whole(image: Any, where: str) -> tuple[str, ...]:
    """Return a note on bytes after the voxels.

    Raises SourceError where an uncompressed file ends before its voxels, or where the compressed
    header of a pair is damaged. Compressed voxels are checked when they are read.
    """
    name, data = image.file_map["image"].filename, image.dataobj
    held = image.file_map.get("header")
    if held is not None and held.filename != name and _is_packed(held.filename):
        with (
            one_line(where, "a complete header of NIfTI"),
            open(held.filename, "rb") as file,
        ):
            unpack(file, 0, "gzip", most_behind=_MAX_OFFSET)
    if _is_packed(name):
        return ()
    shape = tuple(map(int, data.shape))  # products of NumPy's integers would overflow
    end, size = data.offset + math.prod(shape) * data.dtype.itemsize, os.path.getsize(name)
    if end > size:
        raise SourceError(
            f"{where}: found {size} bytes, expected at least {end} for {shape} of "
            f"{data.dtype.name} (the file is cut short)"
        )
    if isinstance(image, nibabel.freesurfer.mghformat.MGHImage):
        return ()  # MGH stores parameters of the scan after the voxels
    return rest_note(size - end, shape, data.dtype.itemsize)


def _is_packed(name: str) -> bool:
    return name.lower().endswith((".gz", ".mgz"))


def stored_header(image: Any) -> Any:
    """Return the header with its fields as stored, since nibabel corrects some of them."""
    held, header = image.file_map.get("header") or image.file_map["image"], image.header
    with ImageOpener(held.filename) as file:
        raw = file.read(len(header.binaryblock))
    if isinstance(header, MGHHeader):
        return np.frombuffer(raw[: header._hdrdtype.itemsize], header._hdrdtype)[0]
    return type(header)(raw, endianness=header.endianness, check=False)


def stored_voxels(name: str, data: Any, time: int) -> NDArray[Any]:
    """Return the voxels of a time point, (x, y, z), as stored in a file.

    data  nibabel's proxy of all voxels
    """
    if _is_packed(name):
        zyx = [int(n) for n in data.shape[2::-1]]
        skip = data.offset + time * math.prod(zyx) * data.dtype.itemsize
        return unpack_array(name, zyx, data.dtype, "gzip", 0, skip=skip).transpose()
    place = (slice(None),) * 3 + (time, 0, 0, 0)[: len(data.shape) - 3]
    with open(name, "rb") as file:
        found = fileslice(file, place, data.shape, data.dtype, data.offset, data.order)  # type: ignore[no-untyped-call]
    return np.asarray(found)
