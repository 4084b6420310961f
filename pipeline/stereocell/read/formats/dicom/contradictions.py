"""Compare what DICOM headers state about a stack's geometry with the geometry that is used.

The order of trust: ImagePositionPatient and ImageOrientationPatient were written for each image
while it was acquired. PixelSpacing is the attribute that the standard defines. All others repeat
them. Each contradiction becomes one note.

References: DICOM PS3.3 C.7.6.2.1.1 (positions and orientation), C.7.6.2 (Image Plane module).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stereocell.model.counted import agreeing
from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.plane_stack import REGULAR, StackLayout, normal_of
from stereocell.read.statements import Statement, Subject, Trust, settle

_POSITION = "ImagePositionPatient"
_GIVEN = "--spacing-um z,y,x replaces it"
_DISTANCE = Subject("distance of slices", "mm", REGULAR, _GIVEN)
_PIXELS = Subject("pixel spacing (rows, columns)", "mm", 0.01, _GIVEN)
_ASPECT = Subject("spacing of rows over that of columns", tolerance=0.01, remedy=_GIVEN)
_ORDER = Subject("order of slices")
_TILT = Subject("gantry tilt", "degrees")
_LETTERS = Subject("directions of rows and columns in the patient")
_TILT_DEG = 0.5  # degrees by which a stated tilt may differ from the one in the positions
_WOBBLE = 2e-4  # rad; orientations that differ more are not just rounded
_GAP = 1.5  # slices that are more thicknesses apart leave gaps
_OVERLAP = 3.0  # slices thicker than this many distances overlap more than in usual reconstructions
_AXES = ("LR", "PA", "HF")  # letters for the directions of growing and falling x, y, z (LPS)
_ALONG = 0.5  # smallest cosine between a direction and the axis that a letter names


def geometry_notes(frames: Sequence[Frame], layout: StackLayout) -> tuple[str, ...]:
    """Return a sentence for each contradiction.

    frames  frames of one time point that were laid out, rising along the normal
    """
    return (
        *dict.fromkeys(note for frame in frames for note in frame.stated.count_notes),
        *_slice_notes(frames, layout),
        *_distance_notes(frames, layout),
        *_thickness_notes(frames, layout),
        *_pixel_notes(frames),
        *_order_notes(frames),
        *_wobble_notes(frames),
        *_tilt_notes(frames, layout),
        *_patient_notes(frames),
    )


def _slice_notes(frames: Sequence[Frame], layout: StackLayout) -> tuple[str, ...]:
    """Return a note if NumberOfSlices differs from the number of slices."""
    stated = [int(f.stated.slices) for f in frames if f.stated.slices and f.stated.slices > 0]
    count = len(frames)
    if not stated or count in stated or count + layout.missing in stated:
        return ()
    are = agreeing(count, "is", "are")
    words = f"number of slices: NumberOfSlices states {stated[0]}, but there {are} {count}"
    if count > stated[0]:
        return (f"{words}: all of them are read",)
    return (
        f"{words}: {1 - count / stated[0]:.0%} of the stated slices are missing (copy the series "
        "again if they were lost)",
    )


def _distance_notes(frames: Sequence[Frame], layout: StackLayout) -> tuple[str, ...]:
    if not layout.is_even or layout.missing:
        return ()
    distance = layout.spacing_mm[0]
    statements = [Statement(distance, _POSITION, Trust.MEASURED)]
    between = [f.stated.between_mm for f in frames if f.stated.between_mm is not None]
    if between:
        statements.append(Statement(float(np.median(between)), "SpacingBetweenSlices"))
    by_location, rounding = _location_step(frames)
    steps = (np.array(frames[-1].position) - frames[0].position) / (len(frames) - 1)
    # Locations are also counted along the table, and a tilted gantry is oblique to the table.
    along = (distance, float(np.linalg.norm(steps)), abs(float(steps[2])))
    if by_location and not any(
        abs(by_location - one) <= max(REGULAR * one, rounding) for one in along
    ):
        statements.append(Statement(by_location, "SliceLocation", Trust.REPEATED))
    return settle(_DISTANCE, statements).notes


def _location_step(frames: Sequence[Frame]) -> tuple[float, float]:
    """Return the mean distance of SliceLocations, and its error if they are whole numbers.

    The distance is 0 if some frames have no location, or all have the same.
    """
    found = [f.stated.location_mm for f in frames if f.stated.location_mm is not None]
    if len(found) < len(frames):
        return 0.0, 0.0
    steps = len(found) - 1
    is_whole = all(value.is_integer() for value in found)
    return float(np.ptp(found)) / steps, is_whole / steps


def _thickness_notes(frames: Sequence[Frame], layout: StackLayout) -> tuple[str, ...]:
    found = [f.stated.thickness_mm for f in frames if f.stated.thickness_mm is not None]
    if not found:
        return ()
    thickness, distance = float(np.median(found)), float(np.median(layout.gaps_mm))
    if distance > _GAP * thickness:
        return (
            f"slices are {thickness:.4g} mm thick (SliceThickness) and {distance:.4g} mm apart "
            f"({_POSITION}): {1 - thickness / distance:.0%} of the distance lies in gaps between "
            "slices, where nothing was imaged",
        )
    if thickness > _OVERLAP * distance:
        return (
            f"slices are {thickness:.4g} mm thick (SliceThickness) and {distance:.4g} mm apart "
            f"({_POSITION}): the positions are used, and neighbouring slices overlap",
        )
    return ()


def _pixel_notes(frames: Sequence[Frame]) -> tuple[str, ...]:
    notes: list[str] = []
    first = frames[0]
    if first.stated.detector_mm is not None:
        stated = Statement(first.spacing, "PixelSpacing")
        detector = Statement(first.stated.detector_mm, first.stated.detector_name, Trust.REPEATED)
        notes += settle(_PIXELS, [stated, detector]).notes
    if first.stated.aspect is not None:
        stated = Statement(first.spacing[0] / first.spacing[1], "PixelSpacing")
        aspect = Statement(first.stated.aspect, "PixelAspectRatio", Trust.REPEATED)
        notes += settle(_ASPECT, [stated, aspect]).notes
    return tuple(notes)


def _order_notes(frames: Sequence[Frame]) -> tuple[str, ...]:
    """Return a note if other attributes count the slices in another order."""
    statements = [Statement("the order that is used", _POSITION, Trust.MEASURED)]
    counted: tuple[tuple[str, list[float | None]], ...] = (
        ("InstanceNumber", [float(f.number) for f in frames]),
        ("InStackPositionNumber", [f.stated.in_stack for f in frames]),
        ("SliceLocation", [f.stated.location_mm for f in frames]),
    )
    for name, values in counted:
        numbers = [value for value in values if value is not None]
        steps = np.sign(np.diff(numbers))
        if len(numbers) < len(frames) or len(set(numbers)) < len(numbers):
            continue
        back = int(min((steps < 0).sum(), (steps > 0).sum()))
        if back:
            text = (
                f"another order ({back} of {len(steps)} steps "
                f"{agreeing(back, 'leads', 'lead')} back)"
            )
            statements.append(Statement(text, name, Trust.REPEATED))
    return settle(_ORDER, statements).notes


def _wobble_notes(frames: Sequence[Frame]) -> tuple[str, ...]:
    """Return a note if the orientation changes by more than rounding."""
    directions = np.array([(f.along_row, f.along_column) for f in frames])
    turned = float(np.linalg.norm(directions - directions.mean(axis=0), axis=2).max())
    if turned <= _WOBBLE:
        return ()
    return (
        f"ImageOrientationPatient changes by up to {np.degrees(turned):.2g} degrees from slice to "
        "slice: its mean is used",
    )


def _tilt_notes(frames: Sequence[Frame], layout: StackLayout) -> tuple[str, ...]:
    if layout.jump_mm:
        return ()  # the positions show no tilt to compare with
    found = [f.stated.tilt_deg for f in frames if f.stated.tilt_deg is not None]
    if not found:
        return ()
    stated = float(np.median(found))
    normal = normal_of(frames[0].along_row, frames[0].along_column)
    turned = float(np.degrees(np.arccos(min(1.0, abs(float(normal[2]))))))
    if any(abs(abs(stated) - seen) <= _TILT_DEG for seen in (layout.tilt_deg, turned)):
        return ()
    measured = Statement(layout.tilt_deg, _POSITION, Trust.MEASURED)
    return settle(_TILT, [measured, Statement(stated, "GantryDetectorTilt")]).notes


def _patient_notes(frames: Sequence[Frame]) -> tuple[str, ...]:
    notes = []
    positions = sorted({f.stated.position for f in frames if f.stated.position})
    if len(positions) > 1:
        notes.append(
            f"PatientPosition is {' and '.join(positions)} among the slices of one stack: the "
            "patient's sides follow from ImageOrientationPatient"
        )
    first = frames[0]
    if not first.stated.directions or first.is_quadruped:
        return tuple(notes)
    pairs = zip(first.stated.directions, (first.along_row, first.along_column), strict=True)
    if all(_leads(word[0], np.array(vector)) for word, vector in pairs):
        return tuple(notes)
    used = tuple(_letter(np.array(v)) for v in (first.along_row, first.along_column))
    measured = Statement(used, "ImageOrientationPatient", Trust.MEASURED)
    stated = Statement(first.stated.directions, "PatientOrientation", Trust.REPEATED)
    return (*notes, *settle(_LETTERS, [measured, stated]).notes)


def _leads(letter: str, vector: NDArray[np.float64]) -> bool:
    axis = next(i for i, letters in enumerate(_AXES) if letter in letters)
    sign = 1 if _AXES[axis][0] == letter else -1
    return bool(sign * vector[axis] >= _ALONG)


def _letter(vector: NDArray[np.float64]) -> str:
    """Return the letter of the side that a direction leads to."""
    axis = int(np.abs(vector).argmax())
    return _AXES[axis][int(vector[axis] < 0)]
