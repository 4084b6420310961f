"""Header values that repeat or describe a frame's geometry. They are compared, and never used.

References: DICOM PS3.3 C.7.6.2 (Image Plane module), C.7.3.1.1.2 (Patient Position), C.7.6.1.1.1
(Patient Orientation), C.8.15.3.2 (CT Position).
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from stereocell.read.formats.dicom.header_values import find_number, find_text
from stereocell.read.formats.dicom.silence_logs import DICOM_FAULTS
from stereocell.read.statements import Statement, Subject, Trust, settle

STATED_TAGS: list[Any] = [
    "SpacingBetweenSlices",
    "SliceThickness",
    "SliceLocation",
    "ImagerPixelSpacing",
    "NominalScannedPixelSpacing",
    "GantryDetectorTilt",
    "PatientPosition",
    "PatientOrientation",
    "NumberOfSlices",
    "NumberOfTimeSlices",
    "NumberOfTimeSlots",
    "NumberOfTemporalPositions",
    "PixelAspectRatio",
]
_COUNT = Subject("number of frames in a file")
_POSITION = re.compile(r"(HF|FF)(S|P|DR|DL)|(L|R|A|P)F[SP]|(AF|PF)D[RL]")
_DIRECTION = re.compile(r"[LRAPHF]{1,3}")


@dataclass(frozen=True, slots=True)
class Stated:
    """Values beside ImagePositionPatient and ImageOrientationPatient; None or empty: not stated.

    thickness_mm, between_mm, location_mm  SliceThickness, SpacingBetweenSlices, SliceLocation
    detector_mm    mm between (rows, columns) of the detector or scanner
    detector_name  name of the attribute that states detector_mm
    tilt_deg     GantryDetectorTilt
    in_stack     InStackPositionNumber
    position     PatientPosition, one of the standard's codes
    directions   PatientOrientation: the directions of rows and columns, such as ("L", "P")
    slices       NumberOfSlices of the volume
    volumes      number of time points, and the attribute that states it
    aspect       PixelAspectRatio: spacing of rows over that of columns
    count_notes  notes on contradictions in the number of the file's frames
    """

    thickness_mm: float | None = None
    between_mm: float | None = None
    location_mm: float | None = None
    detector_mm: tuple[float, float] | None = None
    detector_name: str = ""
    tilt_deg: float | None = None
    in_stack: float | None = None
    position: str = ""
    directions: tuple[str, ...] = ()
    slices: float | None = None
    volumes: tuple[float, str] | None = None
    aspect: float | None = None
    count_notes: tuple[str, ...] = ()


def count_frames(stated: int, groups: int, held: int | None) -> tuple[int, tuple[str, ...]]:
    """Return the number of a file's frames, and notes where statements of it differ.

    stated  NumberOfFrames, or 1
    groups  items of PerFrameFunctionalGroupsSequence; 0: it is absent
    held    complete frames in the pixel data; None: not known
    """
    statements = [Statement(stated, "NumberOfFrames")]
    if groups:
        # Groups that match the frames in the pixel data describe real frames.
        trust = Trust.MEASURED if groups == held else Trust.REPEATED
        statements.append(Statement(groups, "PerFrameFunctionalGroupsSequence", trust))
    if held is not None and held > stated:
        statements.append(Statement(held, "the pixel data", Trust.DERIVED))
    settled = settle(_COUNT, statements)
    return int(settled.number), settled.notes


def stated_of(header: Any, groups: Sequence[Any], count_notes: tuple[str, ...] = ()) -> Stated:
    """Return the values that a frame's header and functional groups state."""
    measures = "PixelMeasuresSequence"
    between = find_number(header, groups, measures, "SpacingBetweenSlices")
    thickness = find_number(header, groups, measures, "SliceThickness")
    detector, name = _detector(header)
    position = find_text(header, groups, "", "PatientPosition").upper()
    return Stated(
        thickness_mm=thickness if thickness and thickness > 0 else None,
        between_mm=abs(between) if between else None,
        location_mm=find_number(header, groups, "", "SliceLocation"),
        detector_mm=detector,
        detector_name=name,
        tilt_deg=find_number(header, groups, "CTGeometrySequence", "GantryDetectorTilt"),
        in_stack=find_number(header, groups, "FrameContentSequence", "InStackPositionNumber"),
        position=position if _POSITION.fullmatch(position) else "",
        directions=_directions(header),
        slices=find_number(header, groups, "", "NumberOfSlices"),
        volumes=_volumes(header),
        aspect=_aspect(header),
        count_notes=count_notes,
    )


def _detector(header: Any) -> tuple[tuple[float, float] | None, str]:
    for name in ("ImagerPixelSpacing", "NominalScannedPixelSpacing"):
        try:
            rows, columns = (float(value) for value in header.get(name) or ())
        except DICOM_FAULTS:
            continue
        if rows > 0 and columns > 0:
            return (rows, columns), name
    return None, ""


def _aspect(header: Any) -> float | None:
    try:
        rows, columns = (float(value) for value in header.get("PixelAspectRatio") or ())
    except DICOM_FAULTS:
        return None
    return rows / columns if rows > 0 and columns > 0 else None


def _directions(header: Any) -> tuple[str, ...]:
    try:
        words = tuple(str(word).strip().upper() for word in header.get("PatientOrientation") or ())
    except DICOM_FAULTS:
        return ()
    if len(words) != 2 or not all(_DIRECTION.fullmatch(word) for word in words):
        return ()
    axes = {next(axis for axis in ("LR", "AP", "HF") if word[0] in axis) for word in words}
    return words if len(axes) == 2 else ()  # rows and columns along one axis are an error


def _volumes(header: Any) -> tuple[float, str] | None:
    for name in ("NumberOfTimeSlices", "NumberOfTimeSlots", "NumberOfTemporalPositions"):
        number = find_number(header, (), "", name)
        if number is not None and number > 1:
            return number, name
    return None
