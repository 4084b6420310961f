"""What a DICOM segmentation says of its segments: kind, numbers, codes, colours, and no text.

A segment is called by its coded property type, in the words that pydicom's copy of the standard's
tables has for that code. The file's own words, which are free text, are not looked at: label,
description, tracking identifier, and the meaning that stands beside the code.

References: DICOM PS3.3 C.8.20.2 (Segmentation Image module); PS3.3 C.10.7.1.1 (CIELab values);
PS3.16 (codes).
"""

from collections import Counter
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydicom.sr._snomed_dict import mapping as snomed
from pydicom.sr.codedict import codes
from pydicom.uid import SegmentationStorage

from stereocell.model.color import linear_color_of_lab
from stereocell.model.object_notes import ObjectNotes

BINARY, FRACTIONAL, LABELMAP = "BINARY", "FRACTIONAL", "LABELMAP"
_CLASSES = (SegmentationStorage, "1.2.840.10008.5.1.4.1.1.66.7")  # and the label map


@dataclass(frozen=True, slots=True)
class Segmentation:
    """One file's segments.

    kind        BINARY: a frame has the bits of one segment; FRACTIONAL: its shares; LABELMAP: a
                pixel is a segment's number
    overlap     whether segments do: YES or NO; other words leave it open
    count       of segments, the background left out
    between_mm  from plane to plane, as stated; 0: it is not
    objects     names and colours by number
    """

    kind: str
    overlap: str
    count: int
    between_mm: float
    objects: ObjectNotes

    @property
    def words(self) -> str:
        """How many segments, in words."""
        return f"{self.count} segment{'s' * (self.count != 1)}"


def segmentation_of(header: Any) -> Segmentation | None:
    """Return a file's segmentation; None: it is none. Raises DICOM_FAULTS."""
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
    alike = Counter(names.values())
    for number, name in names.items():  # ten nodules are ten objects
        if alike[name] > 1:
            names[number] = f"{name} (segment {number})"
    return Segmentation(
        str(header.get("SegmentationType") or BINARY).strip(),
        str(header.get("SegmentsOverlap") or "").strip(),
        max(1, len(names)),
        _between_mm(header),
        ObjectNotes(names, colors),
    )


def _name(segment: Any) -> str:
    """Return the standard's words for the property type and its modifiers, as `Kidney, left`."""
    for coded in segment.get("SegmentedPropertyTypeCodeSequence") or ():
        name = _meaning(coded)
        modifiers = coded.get("SegmentedPropertyTypeModifierCodeSequence") or ()
        found = filter(None, map(_meaning, modifiers))
        return ", ".join([name, *(word.lower() for word in found)]) if name else ""
    return ""


def _meaning(coded: Any) -> str:
    """Return the standard's words for a code; empty: it is none of the standard's."""
    scheme, value = str(coded.get("CodingSchemeDesignator")), str(coded.get("CodeValue"))
    if scheme == "SRT":  # SNOMED's codes of before 2020
        scheme, value = "SCT", snomed["SRT"].get(value, "")
    return _meanings().get((scheme, value), "")


@cache
def _meanings() -> dict[tuple[str, str], str]:
    """Return the shortest words, as `Liver` of `Liver structure (body structure)`, by code."""
    listed = [code for name in codes.schemes() for code in getattr(codes, name).concepts.values()]
    listed.sort(key=lambda code: (-len(code.meaning), code.meaning))
    return {(code.scheme_designator, code.value): code.meaning for code in listed}


def _between_mm(header: Any) -> float:
    for group in header.get("SharedFunctionalGroupsSequence") or ():
        for measures in group.get("PixelMeasuresSequence") or ():
            return abs(float(measures.get("SpacingBetweenSlices") or 0))
    return 0.0
