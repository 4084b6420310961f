"""Read NIfTI-1 and -2 (.nii, .nii.gz, pairs of .hdr and .img), Analyze 7.5 and FreeSurfer's MGH.

nibabel reads the files; statements.py finds the place of the voxels. NaN marks voxels outside a
brain that was extracted. NaN and infinity are read as the smallest finite value of their time
point. Analyze states no orientation: nibabel assumes that x runs to the patient's left, and uses
SPM's matrix beside the pair (.mat) as the affine. The file's name and texts in the header
(`descrip`, `db_name`, the command lines after the voxels of MGH) may identify a patient and are not
read.

References: NIfTI-1 Data Format, https://nifti.nimh.nih.gov/nifti-1/;
https://surfer.nmr.mgh.harvard.edu/fswiki/FsTutorial/MghFormat
"""

import math
import os
from functools import partial
from typing import Any

import nibabel
import numpy as np
from nibabel.freesurfer.mghformat import MGHImage
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.model.object_notes import ObjectNotes
from stereocell.read.acquired import Acquired
from stereocell.read.anatomical_axes import Canonical, canonical_of
from stereocell.read.dataset import VoxelArray
from stereocell.read.formats.nifti.b_values import image_order
from stereocell.read.formats.nifti.file import (
    FAULTS,
    files_of,
    open_image,
    require_whole,
    stored_voxels,
)
from stereocell.read.formats.nifti.statements import stated_place, value_notes
from stereocell.read.image import Image
from stereocell.read.label_notes import notes_of_nifti
from stereocell.read.resample import orthogonal_grid, resample_sheared
from stereocell.read.rescale import dtype_for, rescale
from stereocell.read.spacing import Grid
from stereocell.read.whole_array import WholeArray
from stereocell.storage.library_errors import raise_if_short
from stereocell.storage.location import Location

NAME, ANALYZE, MGH = "NIfTI", "Analyze", "MGH"
_RAS_TO_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])
_INTENT_LABEL = 1002
_LABEL_TABLE = b"<LabelTable"  # XML element in files of Connectome Workbench and TotalSegmentator
_WIDER = 1.05  # ratio of spacings from which slices lie clearly farther apart than pixels
_SKEW = 1e-3  # cosine between two axes; a smaller one is due to rounding


def read_image(location: Location) -> Image:
    """Return the volume of the file, with all its time points. Raises SourceError."""
    where = location.shown
    image = open_image(location)
    header = image.header
    shape = tuple(int(n) for n in header.get_data_shape())
    if len(shape) < 3 or any(n != 1 for n in shape[4:]) or min(shape) < 1:
        several = math.prod(shape[4:])
        inner = f", {several} values at each voxel: save only one of them" * (several > 1)
        raise SourceError(f"{where}: dim: found {shape}, expected x, y, z, or x, y, z, t{inner}")
    stored = header.get_data_dtype()
    if stored.kind not in "iuf":
        found = {"c": "complex numbers", "V": "colours"}.get(stored.kind, str(stored))
        raise SourceError(
            f"{where}: datatype: found {found}, expected whole or real numbers: save only one "
            "part, such as magnitude or red"
        )
    dtype = _dtype(stored, image.dataobj.slope, image.dataobj.inter)
    is_nifti = isinstance(image, nibabel.nifti1.Nifti1Pair)
    place = stated_place(image, where)
    affine = _RAS_TO_LPS @ place.affine
    lengths = np.linalg.norm(affine[:3, :3], axis=0)
    notes = [*place.notes, *value_notes(image)]
    grid, skewed = (shape[0], shape[1], shape[2]), None
    axes = affine[:3, :3] / lengths
    if np.abs(axes.T @ axes - np.eye(3)).max() > _SKEW:
        skewed = affine
        grid, affine = orthogonal_grid(grid, affine)
        notes.append("the affine has skew axes: resampled onto an orthogonal grid")
    canonical = canonical_of(affine, grid)
    title = NAME if is_nifti else MGH if isinstance(image, MGHImage) else ANALYZE
    z, y, x = (grid[axis] for axis in canonical.order)
    times = shape[3] if len(shape) > 3 else 1
    counts: dict[int, int] = {}
    images = image_order(location, times)
    notes += images.notes

    def load(time: int) -> NDArray[Any]:
        place = images.order[time]
        values, count = _load(location, canonical, skewed, dtype, place)
        counts[time] = count
        return values

    voxels = WholeArray((times, z, y, x), dtype, load)
    notes += require_whole(image, where)
    return Image(
        arrays=(VoxelArray(voxels, ("t", "z", "y", "x")),),
        grids=(Grid((z, y, x), canonical.spacing_um),),
        names=(title,),
        colors=(None,),
        images=1,
        title=title,
        placement=canonical.placement,
        has_sides=place.has_sides,
        labels=_labels(header) if is_nifti else "",
        objects=notes_of_nifti(_tables(header)) if is_nifti else ObjectNotes(),
        acquired=Acquired(_image_axis(header.get_dim_info()[2] if is_nifti else None, canonical)),
        notes=tuple(notes),
        files=(*files_of(image), *images.files),
        notes_at=partial(_count_nan, voxels, counts) if stored.kind == "f" else None,
    )


def _labels(header: Any) -> str:
    """Return the field that says that voxels number objects; empty: none. Names are not read."""
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
    """Return the axis perpendicular to the scanner's images: 0, 1 or 2 for z, y or x.

    named  stored axis that the header's `dim_info` names; None: it names none

    Without a name, the axis with the widest spacing is chosen. Among axes that are equally wide, up
    to the factor _WIDER, it is the last stored one, which is the slowest in the file.
    """
    if named is not None:
        return canonical.order.index(named)
    spacing = canonical.spacing_um
    wide = [axis for axis in range(3) if spacing[axis] * _WIDER >= max(spacing)]
    return max(wide, key=lambda axis: canonical.order[axis])


def _count_nan(voxels: WholeArray, counts: dict[int, int], time: int) -> tuple[str, ...]:
    """Read a time point, which is then cached, and note its number of NaN and infinite voxels."""
    _ = voxels[time, slice(0, 0), 0, 0]
    found = counts.get(time, 0)
    note = f"{found:,} voxels are NaN or infinite: read as the smallest finite value"
    return (note,) if found else ()


def _dtype(stored: np.dtype[Any], slope: float, intercept: float) -> np.dtype[Any]:
    if stored.kind == "f":
        return np.dtype(np.float32)
    if stored.itemsize >= 4 and (slope, intercept) == (1, 0):
        return stored.newbyteorder("=")  # label maps keep these integers; cast.py converts others
    limits = np.iinfo(stored)
    return dtype_for([(float(limits.min), float(limits.max), float(slope), float(intercept))])


def _load(
    location: Location,
    canonical: Canonical,
    skewed: NDArray[np.float64] | None,
    dtype: np.dtype[Any],
    time: int,
) -> tuple[NDArray[Any], int]:
    """Return one image of the file, and its number of voxels that are NaN or infinite."""
    count = 0
    try:
        image = open_image(location)
        data = image.dataobj
        raw = stored_voxels(image.file_map["image"].filename, data, time)
        is_measured = np.isfinite(raw)
        values = rescale(raw, float(data.slope), float(data.inter), dtype)
    except FAULTS as error:
        raise_if_short(error, location.shown)
        found = "the voxels can't be read"
        if isinstance(error, EOFError):
            found = f"cut short at byte {os.path.getsize(location.source)}"
        elif isinstance(error, OSError) and not error.strerror:
            found = str(error)
        raise SourceError(f"{location.shown}: {found}, expected a complete {NAME} file") from None
    if values.dtype.kind == "f":
        values, count = _without_gaps(values, is_measured, location.shown)
    if skewed is not None:
        values, _ = resample_sheared(values, skewed)
    return canonical.apply(values), count


def _without_gaps(
    values: NDArray[Any], is_measured: NDArray[np.bool_], where: str
) -> tuple[NDArray[Any], int]:
    """Return the values with the smallest finite one in place of NaN and infinity, and a count.

    is_measured  where the stored values are finite

    Raises SourceError where no value is finite, or one is beyond float32.
    """
    if (is_measured & ~np.isfinite(values)).any():
        raise SourceError(
            f"{where}: found voxels beyond float32, expected smaller ones: rescale them"
        )
    count = is_measured.size - int(np.count_nonzero(is_measured))
    if count == 0:
        return values, 0
    if count == is_measured.size:
        raise SourceError(
            f"{where}: found no finite voxel: all are NaN or infinite, expected an image"
        )
    return np.where(is_measured, values, values[is_measured].min()), count
