"""Compare what headers of NIfTI, Analyze and MGH state on size, direction, unit and values.

NIfTI states the place of its voxels up to three times: in `sform`, in `qform`, and the voxel
spacing again in `pixdim`. The order of trust is that of nibabel and most programs: sform, then
qform, then pixdim alone. A form whose axes don't span three dimensions is skipped.
"""

from dataclasses import dataclass
from typing import Any

import nibabel
import numpy as np
from nibabel.freesurfer.mghformat import MGHImage
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.formats.nifti.file import stored_header
from stereocell.read.plausible_size import size_notes
from stereocell.read.statements import Statement, Subject, Trust, settle

_MM = {"mm": 1.0, "meter": 1000.0, "micron": 0.001}
_REMEDY = "--spacing-um z,y,x replaces it"
_DIRECTIONS = Subject("directions to which the stored axes run")
_UNIT = Subject("unit of length", remedy=_REMEDY)
_MIN_VOLUME = 0.1  # volume spanned by the three unit axes, 0..1; below it they lie in one plane
_MIN_ANGLE = 1.0  # degrees; a smaller rotation between sform and qform is due to rounding
_NO_TIME = ("hz", "ppm", "rads")  # units of a fourth axis that is not time

Affine = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Stated:
    """The place of the voxels as a header states it.

    affine    (4, 4) for column vectors: from stored indices to RAS in mm
    has_sides whether the header states which side of the patient is which
    """

    affine: Affine
    has_sides: bool
    notes: tuple[str, ...]


def stated_place(image: Any, where: str) -> Stated:
    """Return the place of the voxels, and notes. Raises SourceError for an unusable affine."""
    if isinstance(image, MGHImage):
        return _of_mgh(image, where)
    if not isinstance(image, nibabel.nifti1.Nifti1Pair):
        return _of_analyze(image, where)
    header: Any = image.header
    forms = [
        (name, np.asarray(form, float))
        for name, form, code in (
            ("sform", header.get_sform(), int(header["sform_code"])),
            ("qform", _qform(header), int(header["qform_code"])),
        )
        if code
    ]
    sound = [(name, form) for name, form in forms if _is_sound(form)]
    flat = [name for name, form in forms if not _is_sound(form)]
    notes = [
        f"{name}: its axes don't span three dimensions: {sound[0][0]} is used"
        for name in flat
        if sound
    ]
    affine = sound[0][1] if sound else np.asarray(image.affine, float)
    _require_sound(affine, where, "sform and qform")
    if not forms:
        notes.append(
            "neither sform nor qform: which side is left is a guess, x to the patient's left"
        )
    unit, unit_notes = _unit(header)
    notes += [*_size_notes(image, sound, unit), *_direction_notes(sound), *unit_notes]
    affine = _scaled(affine, _MM[unit])
    return Stated(affine, bool(forms), (*notes, *_plausible(image, affine), *_axis_notes(header)))


def _qform(header: Any) -> Affine:
    """Return the affine of qform; NaN where its quaternion is not a rotation, or damaged."""
    try:
        return np.asarray(header.get_qform(), float)
    except ValueError:
        return np.full((4, 4), np.nan)


def value_notes(image: Any) -> tuple[str, ...]:
    """Return a note if the header states an intercept without a slope.

    NIfTI scales no values where the slope is 0; programs also write NaN to mean that.
    """
    if not isinstance(image, nibabel.nifti1.Nifti1Pair):
        return ()
    stored = stored_header(image)
    slope, intercept = float(stored["scl_slope"]), float(stored["scl_inter"])
    is_scaled = np.isfinite(slope) and slope != 0
    if is_scaled or not np.isfinite(intercept) or not intercept:
        return ()
    return (
        f"values: scl_slope {slope:g} states that they are not scaled: scl_inter {intercept:g} is "
        "left out",
    )


def _of_analyze(image: Any, where: str) -> Stated:
    affine = np.asarray(image.affine, float)
    _require_sound(affine, where, "affine")
    notes = ["Analyze states no orientation: x to the patient's left is a guess"]
    beside = image.file_map.get("mat")
    if beside is not None and beside.filename and not np.allclose(affine, _own_affine(image)):
        notes += _compared({"the matrix of SPM (.mat)": _lengths(affine)}, _pixdim(image.header))
    return Stated(affine, False, (*notes, *_plausible(image, affine)))


def _plausible(image: Any, affine: Affine) -> tuple[str, ...]:
    return size_notes(_lengths(affine), [int(n) for n in image.header.get_data_shape()[:3]])


def _own_affine(image: Any) -> Affine:
    return np.asarray(image.header.get_best_affine(), float)


def _of_mgh(image: Any, where: str) -> Stated:
    affine = np.asarray(image.affine, float)
    _require_sound(affine, where, "delta and Mdc")
    notes: tuple[str, ...] = ()
    if not (has_sides := bool(stored_header(image)["goodRASFlag"])):
        notes = (
            "goodRASFlag 0: spacing and orientation are not stated: coronal slices with voxels of "
            f"1 mm are assumed, as in FreeSurfer; {_REMEDY}",
        )
    return Stated(affine, has_sides, (*notes, *_plausible(image, affine)))


def _unit(header: Any) -> tuple[str, tuple[str, ...]]:
    stated = str(header.get_xyzt_units()[0])
    statements = [Statement("mm", "as in most programs for NIfTI", Trust.ASSUMED)]
    if stated in _MM:
        statements.append(Statement(stated, "xyzt_units"))
    settled = settle(_UNIT, statements)
    return str(settled.value), settled.notes


def _size_notes(image: Any, forms: list[tuple[str, Affine]], unit: str) -> tuple[str, ...]:
    """Compare the lengths of sform's axes with pixdim, which also gives qform its lengths."""
    stored = stored_header(image)
    pixdim = np.abs(np.asarray(stored["pixdim"][1:4], float))
    if (pixdim == 0).any() and (not forms or forms[0][0] == "qform"):
        return (f"pixdim: found 0, read as 1: is the voxel spacing known? ({_REMEDY})",)
    if not forms or forms[0][0] != "sform" or not np.isfinite(pixdim).all() or not pixdim.all():
        return ()
    place = "pixdim (and qform)" if len(forms) > 1 else "pixdim"
    return _compared({"sform": _lengths(forms[0][1]), place: tuple(pixdim)}, None, unit)


def _compared(
    stated: dict[str, Any], pixdim: tuple[float, ...] | None, unit: str = "mm"
) -> tuple[str, ...]:
    """Return the note on voxel spacings along the stored axes that disagree."""
    subject = Subject("voxel spacing along the stored axes", unit, remedy=_REMEDY)
    places = {**stated, **({"pixdim": pixdim} if pixdim is not None and all(pixdim) else {})}
    return settle(
        subject,
        [
            Statement(tuple(float(n) for n in lengths), place, Trust.REPEATED)
            for place, lengths in places.items()
        ],
    ).notes


def _direction_notes(forms: list[tuple[str, Affine]]) -> tuple[str, ...]:
    """Compare the directions of sform's axes and qform's axes."""
    if len(forms) < 2:
        return ()
    orientations: Any = nibabel.orientations
    letters = [tuple(map(str, orientations.aff2axcodes(form))) for _, form in forms]
    named = zip(forms, letters, strict=True)
    notes = settle(_DIRECTIONS, [Statement(codes, name) for (name, _), codes in named]).notes
    if notes:
        return notes
    one, other = (form[:3, :3] / _lengths(form) for _, form in forms)
    cosine = (np.trace(one.T @ other) - 1.0) / 2.0
    angle = float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    if angle < _MIN_ANGLE:
        return ()
    return (f"orientation: sform and qform differ by {angle:.0f} degrees: sform is used",)


def _axis_notes(header: Any) -> tuple[str, ...]:
    """Return a note if the fourth axis is not time."""
    shape, unit = header.get_data_shape(), str(header.get_xyzt_units()[1])
    if len(shape) < 4 or shape[3] < 2 or unit not in _NO_TIME:
        return ()
    return (f"axis t: xyzt_units states {unit}, so its {shape[3]} volumes are not time points",)


def _pixdim(header: Any) -> tuple[float, ...]:
    return tuple(float(abs(n)) for n in header["pixdim"][1:4])


def _lengths(affine: Affine) -> tuple[float, float, float]:
    x, y, z = (float(n) for n in np.linalg.norm(affine[:3, :3], axis=0))
    return x, y, z


def _scaled(affine: Affine, factor: float) -> Affine:
    return np.diag([factor, factor, factor, 1.0]) @ affine


def _is_sound(affine: Affine) -> bool:
    lengths = np.linalg.norm(affine[:3, :3], axis=0)
    if not np.isfinite(affine).all() or lengths.min() <= 0:
        return False
    return bool(abs(np.linalg.det(affine[:3, :3] / lengths)) >= _MIN_VOLUME)


def _require_sound(affine: Affine, where: str, fields: str) -> None:
    if not _is_sound(affine):
        raise SourceError(
            f"{where}: {fields}: the axes of the affine don't span three dimensions, "
            "expected three independent axes"
        )
