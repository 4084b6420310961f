"""NIfTI-1 and -2, .nii and .nii.gz, their pairs .hdr and .img, and Analyze 7.5, read by nibabel.

nibabel chooses the affine: sform, else qform, else a guess by the shape, which a note reports. NaN
marks voxels outside a brain that was cut out; it and infinity are read as the smallest finite value
of their time point. Analyze states no orientation; nibabel takes x to run to the patient's left,
and a matrix of SPM beside the pair (.mat) for the affine. Texts in the header (`descrip`,
`db_name`, ...) and the file's name may identify a patient and are not read.

References: NIfTI-1 Data Format, https://nifti.nimh.nih.gov/nifti-1/
"""

import logging
import math
import os
import warnings
import zlib
from functools import partial
from typing import Any

import nibabel
import numpy as np
from nibabel.cifti2.cifti2 import Cifti2Image
from nibabel.fileslice import fileslice
from nibabel.openers import ImageOpener
from numpy.typing import NDArray
from scipy.io.matlab import MatReadError

from stereocell.model.errors import SourceError
from stereocell.model.object_notes import ObjectNotes
from stereocell.read.acquired import Acquired
from stereocell.read.anatomical_axes import Canonical, canonical_of
from stereocell.read.dataset import VoxelArray
from stereocell.read.file_array import unpack_array
from stereocell.read.image import Image
from stereocell.read.label_notes import notes_of_nifti
from stereocell.read.packed_stream import unpack
from stereocell.read.resample import orthogonal_grid, resample_sheared
from stereocell.read.rescale import dtype_for, rescale
from stereocell.read.spacing import Grid
from stereocell.read.whole_array import WholeArray
from stereocell.storage.library_errors import one_line, raise_if_short
from stereocell.storage.location import Location, require_own

NAME, ANALYZE = "NIfTI", "Analyze"
_RAS_TO_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])
_MM = {"unknown": 1.0, "mm": 1.0, "meter": 1000.0, "micron": 0.001}
_MAX_OFFSET = 1 << 28  # bytes of header and extensions; gzip must unpack them before the voxels
_INTENT_LABEL = 1002
_LABEL_TABLE = b"<LabelTable"  # element in the files of Connectome Workbench and TotalSegmentator
_WIDER = 1.05  # factor by which slices lie further apart than pixels
_SKEW = 1e-3  # cosine between two axes; a smaller one is rounding
_FAULTS = (
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
)


def read_image(location: Location) -> Image:
    """Return the volume of the file, with all its time points. Raises SourceError."""
    where = location.shown
    image = _open(location)
    header = image.header
    shape = tuple(int(n) for n in header.get_data_shape())
    if len(shape) < 3 or any(n != 1 for n in shape[4:]) or min(shape) < 1:
        raise SourceError(f"{where}: dim: found {shape}, expected x, y, z, or x, y, z, t")
    stored = header.get_data_dtype()
    if stored.kind not in "iuf":
        raise SourceError(f"{where}: datatype: found {stored}, expected whole or real numbers")
    dtype = _dtype(stored, image.dataobj.slope, image.dataobj.inter)
    is_nifti = isinstance(image, nibabel.nifti1.Nifti1Pair)
    unit = header.get_xyzt_units()[0] if is_nifti else "mm"
    affine = _RAS_TO_LPS @ np.where(np.isfinite(image.affine), image.affine, 0.0)
    affine[:3] *= _MM[unit]
    lengths = np.linalg.norm(affine[:3, :3], axis=0)
    is_sound = np.isfinite(image.affine).all() and lengths.min() > 0
    if not is_sound or abs(np.linalg.det(affine[:3, :3] / lengths)) < 0.1:
        raise SourceError(f"{where}: sform and qform: found no three axes, expected an affine")
    has_sides = is_nifti and bool(header["sform_code"] or header["qform_code"])
    notes = []
    if not is_nifti:
        notes.append("Analyze states no orientation: x to the left of the patient is a guess")
    elif not has_sides:
        notes.append(
            "neither sform nor qform: which side is left is a guess, x to the left of the patient"
        )
    if is_nifti and not header["sform_code"] and _states_zero(image):
        notes.append("pixdim: found 0, read as 1: is the voxel spacing known? (--spacing-um z,y,x)")
    if unit == "unknown":
        notes.append("no unit of length in the header: mm are assumed")
    grid, skewed = (shape[0], shape[1], shape[2]), None
    axes = affine[:3, :3] / lengths
    if np.abs(axes.T @ axes - np.eye(3)).max() > _SKEW:
        skewed = affine
        grid, affine = orthogonal_grid(grid, affine)
        notes.append("the affine has skew axes: resampled onto an orthogonal grid")
    canonical = canonical_of(affine, grid)
    title = NAME if is_nifti else ANALYZE
    z, y, x = (grid[axis] for axis in canonical.order)
    times = shape[3] if len(shape) > 3 else 1
    counts: dict[int, int] = {}
    load = partial(_load, location, canonical, skewed, dtype, counts)
    voxels = WholeArray((times, z, y, x), dtype, load)
    _require_whole(image, where)
    return Image(
        arrays=(VoxelArray(voxels, ("t", "z", "y", "x")),),
        grids=(Grid((z, y, x), canonical.spacing_um),),
        names=(title,),
        colors=(None,),
        images=1,
        title=title,
        placement=canonical.placement,
        has_sides=has_sides,
        labels=_labels(header) if is_nifti else "",
        objects=notes_of_nifti(_tables(header)) if is_nifti else ObjectNotes(),
        acquired=Acquired(_image_axis(header.get_dim_info()[2] if is_nifti else None, canonical)),
        notes=tuple(notes),
        files=tuple(_files(image)),
        notes_at=partial(_count_nan, voxels, counts) if stored.kind == "f" else None,
    )


def _files(image: Any) -> set[str]:
    """Return the paths of the file or the pair, and of SPM's matrix file beside a pair."""
    held = [one.filename for one in image.file_map.values() if one.filename]
    return {name for name in held if os.path.exists(name)}


def _require_whole(image: Any, where: str) -> None:
    """Raise SourceError where an unpacked file ends before its voxels, or where a pair's packed
    header is damaged. Packed voxels are checked when they are read.
    """
    name, data = image.file_map["image"].filename, image.dataobj
    held = image.file_map.get("header")
    if held is not None and held.filename != name and _is_packed(held.filename):
        with (
            one_line(where, f"a header of {NAME} that is whole"),
            open(held.filename, "rb") as file,
        ):
            unpack(file, 0, "gzip", most_behind=_MAX_OFFSET)
    if _is_packed(name):
        return
    end, size = data.offset + math.prod(data.shape) * data.dtype.itemsize, os.path.getsize(name)
    if end > size:
        raise SourceError(
            f"{where}: found {size} bytes, expected at least {end} for {tuple(data.shape)} of "
            f"{data.dtype.name} (the file is cut short)"
        )


def _is_packed(name: str) -> bool:
    return name.lower().endswith(".gz")


def _states_zero(image: Any) -> bool:
    """Whether the file has a voxel spacing of 0, which nibabel has mended in its header."""
    held, header = image.file_map.get("header") or image.file_map["image"], image.header
    with ImageOpener(held.filename) as file:
        raw = file.read(len(header.binaryblock))
    stored = type(header)(raw, endianness=header.endianness, check=False)
    return bool((stored["pixdim"][1:4] == 0).any())


def _labels(header: Any) -> str:
    """Return what in the header says that voxels number objects; of a table only its presence."""
    if header["intent_code"] == _INTENT_LABEL:
        return f"NIfTI's intent code {_INTENT_LABEL} (label)"
    if any(_LABEL_TABLE in text for text in _tables(header)):
        return "a table of labels in an extension of its header"
    return ""


def _tables(header: Any) -> list[bytes]:
    """Return the contents of the header's extensions."""
    contents = (extension.get_content() for extension in header.extensions)
    return [content for content in contents if isinstance(content, bytes)]


def _image_axis(named: int | None, canonical: Canonical) -> int:
    """Return the axis (of z, y, x) across which the scanner's images lie.

    named  the stored axis that the header's `dim_info` names; None: it names none

    Else it is the axis of the widest spacing, or where several
    are as wide (a share of `_WIDER`), the last stored one: the slowest in the file.
    """
    if named is not None:
        return canonical.order.index(named)
    spacing = canonical.spacing_um
    wide = [axis for axis in range(3) if spacing[axis] * _WIDER >= max(spacing)]
    return max(wide, key=lambda axis: canonical.order[axis])


def _count_nan(voxels: WholeArray, counts: dict[int, int], time: int) -> tuple[str, ...]:
    """Note the number of NaN and infinities at a time point, which this reads; it is cached."""
    _ = voxels[time, slice(0, 0), 0, 0]
    found = counts.get(time, 0)
    note = f"{found:,} voxels are NaN or infinite: read as the smallest finite value"
    return (note,) if found else ()


def _open(location: Location) -> Any:
    _require_own_pair(location)
    logging.getLogger("nibabel.global").disabled = True  # its messages quote fields of the header
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image: Any = nibabel.load(location.source, mmap=False)
            if isinstance(image, Cifti2Image):
                raise SourceError(
                    f"{location.shown}: CIFTI, values on surfaces and in greyordinates; expected "
                    "NIfTI with a volume"
                )
            if not isinstance(image, nibabel.nifti1.Nifti1Pair | nibabel.analyze.AnalyzeImage):
                raise TypeError
            # an invalid quaternion, unit or type fails here rather than later
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
    except _FAULTS as error:
        raise_if_short(error, location.shown)
        raise SourceError(
            f"{location.shown}: not readable as NIfTI, expected a whole .nii or .nii.gz file, "
            "or a pair .hdr and .img"
        ) from None


def _require_own_pair(location: Location) -> None:
    """Raise SourceError where a file beside the source, which nibabel opens, is not its own."""
    stem, suffix = os.path.splitext(location.source)
    packed = suffix if suffix.lower() == ".gz" else ""
    stem, suffix = os.path.splitext(stem) if packed else (stem, suffix)
    if suffix.lower() in (".hdr", ".img"):
        for beside in (".hdr", ".img", ".mat", ".HDR", ".IMG", ".MAT"):
            path = stem + beside + ("" if beside.lower() == ".mat" else packed)
            if os.path.lexists(path):
                require_own(path, [location.folder], named=path)


def _dtype(stored: np.dtype[Any], slope: float, intercept: float) -> np.dtype[Any]:
    if stored.kind == "f":
        return np.dtype(np.float32)
    if stored.itemsize >= 4 and (slope, intercept) == (1, 0):
        return stored.newbyteorder("=")  # labels keep their numbers; read/cast.py has the rest
    limits = np.iinfo(stored)
    return dtype_for([(float(limits.min), float(limits.max), float(slope), float(intercept))])


def _load(
    location: Location,
    canonical: Canonical,
    skewed: NDArray[np.float64] | None,
    dtype: np.dtype[Any],
    counts: dict[int, int],
    time: int,
) -> NDArray[Any]:
    try:
        image = _open(location)
        data = image.dataobj
        raw = _stored(image.file_map["image"].filename, data, time)
        is_measured = np.isfinite(raw)
        values = rescale(raw, float(data.slope), float(data.inter), dtype)
    except _FAULTS as error:
        raise_if_short(error, location.shown)
        found = "its voxels can't be read"
        if isinstance(error, EOFError):
            found = f"cut short at byte {os.path.getsize(location.source)}"
        elif isinstance(error, OSError) and not error.strerror:
            found = str(error)
        raise SourceError(f"{location.shown}: {found}, expected {NAME} that is whole") from None
    if values.dtype.kind == "f":
        values, counts[time] = _without_gaps(values, is_measured, location.shown)
    if skewed is not None:
        values, _ = resample_sheared(values, skewed)
    return canonical.apply(values)


def _stored(name: str, data: Any, time: int) -> NDArray[Any]:
    """Return the voxels of a time point, (x, y, z), as they are stored in a file.

    data  nibabel's proxy of all voxels
    """
    if _is_packed(name):
        zyx = data.shape[2::-1]
        skip = data.offset + time * math.prod(zyx) * data.dtype.itemsize
        return unpack_array(name, zyx, data.dtype, "gzip", 0, skip=skip).transpose()
    place = (slice(None),) * 3 + (time, 0, 0, 0)[: len(data.shape) - 3]
    with open(name, "rb") as file:
        found = fileslice(file, place, data.shape, data.dtype, data.offset, data.order)  # type: ignore[no-untyped-call]
    return np.asarray(found)


def _without_gaps(
    values: NDArray[Any], is_measured: NDArray[np.bool_], where: str
) -> tuple[NDArray[Any], int]:
    """Return the values with the smallest finite one in the place of others, and their number.

    is_measured  where the stored values are finite

    Raises SourceError where none is, or one is beyond float32.
    """
    if (is_measured & ~np.isfinite(values)).any():
        raise SourceError(
            f"{where}: found voxels beyond float32, expected smaller ones: scale them"
        )
    count = is_measured.size - int(np.count_nonzero(is_measured))
    if count == 0:
        return values, 0
    if count == is_measured.size:
        raise SourceError(
            f"{where}: found no finite voxel: all are NaN or infinite, expected an image"
        )
    return np.where(is_measured, values, values[is_measured].min()), count
