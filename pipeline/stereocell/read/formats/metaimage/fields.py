"""Read the fields of a MetaImage header under all their names, and note contradictions.

A position, a matrix, a size and the byte order each have synonyms. If several are given, this
module uses the one that ITK uses, found by reading such files with SimpleITK. Like ITK, it uses the
last line of a repeated field, and keeps the scale of a matrix whose rows are longer than 1.

References: https://itk.org/Wiki/ITK/MetaIO/Documentation
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import nibabel
import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.repeated_fields import settle_repeats
from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

NAME = "MetaImage"
_MAX_HEADER = 1 << 16  # bytes in which the header must end
# field -> its names, in ITK's order of preference
_NAMES = {
    "Offset": ("Origin", "Position", "Offset"),
    "TransformMatrix": ("TransformMatrix", "Rotation", "Orientation"),
    "ElementSpacing": ("ElementSpacing", "ElementSize"),
    "BinaryDataByteOrderMSB": ("BinaryDataByteOrderMSB", "ElementByteOrderMSB"),
}
_FIELD_OF = {name: field for field, names in _NAMES.items() for name in names}
_READ = {
    *_FIELD_OF, "NDims", "DimSize", "ElementType", "ElementNumberOfChannels", "BinaryData",
    "CompressedData", "HeaderSize", "ElementDataFile", "DistanceUnits", "AnatomicalOrientation",
    "ElementToIntensityFunctionSlope", "ElementToIntensityFunctionOffset", "Modality",
}  # fmt: skip
_UNITS_MM = {"mm": 1.0, "um": 1e-3, "cm": 10.0}
_MODALITIES = {"MET_MOD_CT": "CT", "MET_MOD_MR": "MR", "MET_MOD_NM": "NM", "MET_MOD_US": "US"}
_OPPOSITE = dict(zip("RLAPIS", "LRPASI", strict=True))


@dataclass(frozen=True, slots=True)
class Header:
    """The header of a file.

    fields  texts by the fields' usual names
    end     length of the header in bytes
    notes   notes on contradictions between the fields
    """

    fields: dict[str, str]
    end: int
    notes: tuple[str, ...]


def read_header(location: Location) -> Header:
    """Return the header of a file. Raises SourceError where the header doesn't end."""
    with one_line(location.shown, f"a {NAME} file"), open(location.path, "rb") as file:
        content = file.read(_MAX_HEADER)
    stated: list[tuple[str, str]] = []
    end = 0
    for line in content.splitlines(keepends=True):
        end += len(line)
        key, mark, value = line.decode("latin-1").partition("=")
        if not mark:
            break
        name = key.strip()
        if name in _READ:
            stated.append((name, value.strip()))
        if name == "ElementDataFile":
            texts, notes = settle_repeats(stated)
            fields = {name: text for name, text in texts.items() if name not in _FIELD_OF}
            return Header(fields, end, (*notes, *_settle_names(texts, fields)))
    raise SourceError(
        f"{location.shown}: header: found no ElementDataFile in {len(content)} bytes, "
        f"expected {NAME} (.mha, .mhd)"
    )


def _settle_names(stated: dict[str, str], fields: dict[str, str]) -> tuple[str, ...]:
    """Add the fields that have several names to `fields`, and return notes on contradictions."""
    notes: list[str] = []
    for field, names in _NAMES.items():
        statements = [
            Statement(_value(stated[name]), name, Trust.STATED if not rank else Trust.REPEATED)
            for rank, name in enumerate(names)
            if name in stated
        ]
        if statements:
            settled = settle(Subject(f"field {field}"), statements)
            fields[field] = stated[settled.chosen.place]
            notes += settled.notes
    return tuple(notes)


def _value(text: str) -> float | str | tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split())
    except ValueError:
        return text.strip().lower()[:1]  # ITK reads only the first letter of a flag


def require_dimensions(where: str, fields: dict[str, str], count: int) -> None:
    """Raise SourceError where NDims differs from the number of sizes."""
    stated = integers(where, fields, "NDims")
    if stated and stated[0] != count:
        raise SourceError(
            f"{where}: NDims: found {stated[0]}, expected {count}, the number of sizes in DimSize "
            f"({fields['DimSize']:.60}): correct the header"
        )


def unit_mm(fields: dict[str, str]) -> tuple[float, tuple[str, ...]]:
    """Return the length of a unit in mm, and a note on an unknown unit."""
    text = fields.get("DistanceUnits", "mm").strip().lower()
    if text in _UNITS_MM:
        return _UNITS_MM[text], ()
    reason = f"since DistanceUnits {text!r:.20} is not mm, um or cm"
    subject = Subject("unit of length", remedy="--spacing-um z,y,x replaces it")
    return 1.0, settle(subject, [Statement("mm", reason, Trust.ASSUMED)]).notes


def scale_notes(
    spacing: Sequence[float], axes: NDArray[np.float64], mm_per_unit: float
) -> tuple[str, ...]:
    """Return a note if the matrix has a scale, which multiplies the spacing.

    axes  (3, 3): a column for each stored axis
    """
    lengths = np.linalg.norm(axes, axis=0) * spacing * mm_per_unit
    if not np.isfinite(lengths).all() or not lengths.all():
        return ()
    subject = Subject(
        "voxel spacing along the stored axes", "mm", remedy="--spacing-um z,y,x replaces it"
    )
    own = tuple(float(size) * mm_per_unit for size in spacing)
    scaled = "TransformMatrix times ElementSpacing"
    statements = [
        Statement(tuple(lengths.tolist()), scaled),
        Statement(own, "only ElementSpacing", Trust.REPEATED),
    ]
    notes = settle(subject, statements).notes
    return tuple(f"{note} (as in ITK)" for note in notes)


def side_notes(fields: dict[str, str], axes: NDArray[np.float64]) -> tuple[str, ...]:
    """Compare AnatomicalOrientation with the directions of the axes.

    axes  (3, 3): a column in LPS for each stored axis

    Its letters are the sides at which the axes begin; ITK writes them and does not read them.
    """
    letters = fields.get("AnatomicalOrientation", "").strip().upper()
    is_stated = len(letters) == 3 and set(letters) <= set(_OPPOSITE)
    if "TransformMatrix" not in fields:
        stated_sides = f"; AnatomicalOrientation states {letters}" if is_stated else ""
        return (
            "no TransformMatrix: which side is left is a guess, x to the patient's left"
            f"{stated_sides}",
        )
    affine = np.eye(4)
    affine[:3, :3] = np.diag([-1.0, -1.0, 1.0]) @ axes
    if not is_stated or not np.isfinite(axes).all() or abs(np.linalg.det(axes)) < 1e-3:
        return ()
    orientations: Any = nibabel.orientations
    ends = orientations.aff2axcodes(affine)
    begins = tuple(_OPPOSITE[str(end)] for end in ends)
    statements = [
        Statement(begins, "TransformMatrix"),
        Statement(tuple(letters), "AnatomicalOrientation", Trust.REPEATED),
    ]
    return settle(Subject("sides at which the stored axes begin"), statements).notes


def value_notes(where: str, fields: dict[str, str]) -> tuple[str, ...]:
    """Return a note if the header states a scale of values, which ITK does not apply."""
    names = ("ElementToIntensityFunctionSlope", "ElementToIntensityFunctionOffset")
    slope, offset = (
        (numbers(where, fields, name, 1) or [default])[0]
        for name, default in zip(names, (1.0, 0.0), strict=True)
    )
    if (slope, offset) == (1.0, 0.0):
        return ()
    return (
        f"values: {names[0]} {slope:g} and {names[1]} {offset:g} are not applied, as in ITK: "
        "voxels are read as stored",
    )


def modality_of(fields: dict[str, str]) -> str:
    """Return DICOM's code for the modality that the header states; empty: none."""
    return _MODALITIES.get(fields.get("Modality", "").strip(), "")


def integers(where: str, fields: dict[str, str], name: str) -> list[int]:
    """Return a field's whole numbers; empty: the field is absent. Raises SourceError."""
    values = numbers(where, fields, name) or []
    if not all(value.is_integer() and abs(value) < 1 << 40 for value in values):
        raise SourceError(f"{where}: {name}: found {fields[name]:.60}, expected whole numbers")
    return [int(value) for value in values]


def numbers(
    where: str, fields: dict[str, str], name: str, count: int | None = None
) -> list[float] | None:
    """Return a field's numbers; None: the field is absent. Raises SourceError."""
    if name not in fields:
        return None
    try:
        values = [float(part) for part in fields[name].split()]
    except ValueError:
        values = []
    if not values or (count is not None and len(values) != count) or not np.isfinite(values).all():
        raise SourceError(
            f"{where}: {name}: found {fields[name]!r:.60}, expected "
            f"{count if count is not None else 'some'} numbers"
        )
    return values
