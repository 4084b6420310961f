"""The segments of a DICOM segmentation: kind, numbers, codes and colours, but no free text.

A segment is named by its coded property type, in the words that pydicom's copy of the standard's
tables has for that code. The file's own words are free text and are not read: label, description,
tracking identifier, and the meaning beside the code. Only a user who asks for the labels gets them
(`free_labels`).

References: DICOM PS3.3 C.8.20.2 (Segmentation Image module); PS3.3 C.10.7.1.1 (CIELab values);
PS3.16 (codes).
"""

from collections import Counter
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from pydicom.uid import SegmentationStorage

from stereocell.model.color import linear_color_of_lab
from stereocell.model.object_notes import ObjectNotes

if TYPE_CHECKING:
    from pydicom.sr.coding import Code

BINARY, FRACTIONAL, LABELMAP = "BINARY", "FRACTIONAL", "LABELMAP"
_LONGEST = 64  # characters of a segment's label, DICOM's limit
# the second class is that of the label map
_CLASSES = (SegmentationStorage, "1.2.840.10008.5.1.4.1.1.66.7")


@dataclass(frozen=True, slots=True)
class Segmentation:
    """One file's segments.

    kind        BINARY: a frame has one bit per pixel for one segment; FRACTIONAL: a fraction per
                pixel; LABELMAP: a pixel is a segment's number
    overlap     whether segments overlap: YES or NO; other words leave it open
    count       number of segments, without the background
    between_mm  mm from plane to plane, as stated; 0: not stated
    objects     names and colours by number
    """

    kind: str
    overlap: str
    count: int
    between_mm: float
    objects: ObjectNotes

    @property
    def words(self) -> str:
        """The number of segments, in words."""
        return f"{self.count} segment{'s' * (self.count != 1)}"


def segmentation_of(header: Any) -> Segmentation | None:
    """Return a file's segmentation; None: it has none. Raises DICOM_FAULTS."""
    if header.get("SOPClassUID") not in _CLASSES and header.get("Modality") != "SEG":
        return None
    names: dict[int, str] = {}
    colors = {}
    for item in header.get("SegmentSequence") or ():
        number = int(item.get("SegmentNumber") or 0)
        if number <= 0:
            continue
        names[number] = _name(item) or f"Segment {number}"
        lab = item.get("RecommendedDisplayCIELabValue")
        if lab is not None and len(lab) == 3:
            lightness, a, b = (int(part) / 0xFFFF for part in lab)
            colors[number] = linear_color_of_lab((100 * lightness, 255 * a - 128, 255 * b - 128))
    return Segmentation(
        str(header.get("SegmentationType") or BINARY).strip(),
        str(header.get("SegmentsOverlap") or "").strip(),
        max(1, len(names)),
        _between_mm(header),
        ObjectNotes(_with_numbers_if_equal(names), colors),
    )


def free_labels(header: Any) -> dict[int, str]:
    """Return the segments' labels by number. They are free text and may identify the patient.

    Raises DICOM_FAULTS.
    """
    found = {}
    for item in header.get("SegmentSequence") or ():
        number = int(item.get("SegmentNumber") or 0)
        label = " ".join(str(item.get("SegmentLabel") or "").split())
        if number > 0 and label:
            found[number] = "".join(c for c in label if c.isprintable())[:_LONGEST]
    return _with_numbers_if_equal(found)


def _with_numbers_if_equal(names: dict[int, str]) -> dict[int, str]:
    """Return the names with numbers added to equal ones, since ten nodules are ten objects."""
    alike = Counter(names.values())
    return {
        number: f"{name} (segment {number})" if alike[name] > 1 else name
        for number, name in names.items()
    }


def _name(segment: Any) -> str:
    """Return the standard's words for the property type and its modifiers: `Kidney, left`."""
    for coded in segment.get("SegmentedPropertyTypeCodeSequence") or ():
        name = _meaning(coded)
        modifiers = coded.get("SegmentedPropertyTypeModifierCodeSequence") or ()
        found = filter(None, map(_meaning, modifiers))
        return ", ".join([name, *(word.lower() for word in found)]) if name else ""
    return ""


def _meaning(coded: Any) -> str:
    """Return the standard's words for a code; empty: it is not one of the standard's."""
    scheme, value = str(coded.get("CodingSchemeDesignator")), str(coded.get("CodeValue"))
    if scheme == "SRT":
        return _meaning_of_former_code(value)
    return _meanings().get((scheme, value), "")


@cache
def _meaning_of_former_code(value: str) -> str:
    """Return the words for one of SNOMED's former codes, by pydicom's table of current ones."""
    # imported here because all codes are slow to import and rarely needed
    from pydicom.sr.coding import Code

    former = Code(value, "SRT", "")
    same = (one for (_, one), code in _codes().items() if code == former)
    return _meanings().get(("SCT", next(same, "")), "")


@cache
def _codes() -> dict[tuple[str, str], "Code"]:
    """Return SNOMED's codes without repeats."""
    from pydicom.sr.codedict import codes

    return {(code.scheme_designator, code.value): code for code in codes.SCT.concepts.values()}


@cache
def _meanings() -> dict[tuple[str, str], str]:
    """Return the shortest words by code, such as `Liver` for `Liver structure (body structure)`."""
    from pydicom.sr.codedict import codes

    listed = [code for name in codes.schemes() for code in getattr(codes, name).concepts.values()]
    listed.sort(key=lambda code: (-len(code.meaning), code.meaning))
    return {(code.scheme_designator, code.value): code.meaning for code in listed}


def _between_mm(header: Any) -> float:
    for group in header.get("SharedFunctionalGroupsSequence") or ():
        for measures in group.get("PixelMeasuresSequence") or ():
            return abs(float(measures.get("SpacingBetweenSlices") or 0))
    return 0.0
