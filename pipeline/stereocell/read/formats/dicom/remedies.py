"""Remedies in refusals: what a DICOM file without a usable plane is, and what to name instead.

References: DICOM PS3.4 B.5 (Standard SOP Classes).
"""

import re
from collections.abc import Sequence
from typing import Any

from pydicom.uid import UID

from stereocell.read.formats.dicom.frame_kind import FrameKind

_IMAGES = "name the folder of the images"
# patterns of names of SOP classes -> cause and remedy; the first match counts
_CLASSES: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), text)
    for pattern, text in (
        (
            r"RT Structure Set",
            f"an RT structure set holds contours but no voxels: {_IMAGES} that they were drawn on, "
            "or export the contours as a segmentation (SEG) or a label map",
        ),
        (
            r"RT Dose",
            "an RT dose needs GridFrameOffsetVector for the places of its planes: export it again",
        ),
        (r"RT (Ion )?Plan|RT .*Treatment|RT Brachy", f"an RT plan holds no voxels: {_IMAGES}"),
        (r"Dose SR|Dose Report", f"a dose report holds no image: {_IMAGES} that it is about"),
        (
            r"SR Storage|Key Object|Report",
            f"a structured report holds no image: {_IMAGES} that it is about",
        ),
        (
            r"Encapsulated (STL|OBJ|MTL)",
            "an encapsulated mesh holds no voxels: name the folder of the images that it was made "
            "from",
        ),
        (r"Encapsulated", f"an encapsulated document holds no image: {_IMAGES}"),
        (r"Waveform|ECG", f"a waveform is not an image: {_IMAGES}"),
        (
            r"Presentation State",
            f"a presentation state describes how to show other images: {_IMAGES} that it "
            "belongs to",
        ),
        (
            r"Registration|Fiducials|Real World Value Mapping|Raw Data|Measurements|Tractography",
            f"a file of this class describes other images: {_IMAGES} that it belongs to",
        ),
        (r"Media Storage Directory", "a DICOMDIR lists other files: name the folder of the images"),
        (
            r"Secondary Capture",
            "a secondary capture, such as a dose sheet or a screen save, is an image of a screen: "
            "name the folder of the slices",
        ),
        (
            r"Digital X-Ray|Computed Radiography|Mammography X-Ray|X-Ray Angiographic|Radiofluoro"
            r"|RT Image",
            "a radiograph is a projection through the body: name the folder of a CT or an MR",
        ),
        (
            r"Ultrasound|US Volume",
            "ultrasound without places has no known geometry: export a volume with "
            "ImagePositionPatient, or planes as TIFF or PNG with --spacing-um z,y,x",
        ),
        (
            r"Whole Slide|VL |Photography",
            "photographs and slides of microscopes are not a volume: export planes as TIFF",
        ),
    )
)
_ROLES = {
    "dose or protocol sheet": "a dose or protocol sheet is an image of text: name the folder of "
    "the slices",
    "screen save": "a screen save is an image of a screen: name the folder of the slices",
    "localizer": "a localizer (scout) without a place is not a volume: name the folder of the "
    "slices",
    "rendering": "a rendering is only a view of a volume: name the folder of the slices",
}
# start of the reason for leaving a file out -> remedy
_REASONS = (
    (
        "in colour",
        "export the images in grey values, not in colour",
    ),
    (
        "without a PixelSpacing",
        "export the images with PixelSpacing, or as planes of TIFF or PNG with --spacing-um z,y,x "
        "(ImagerPixelSpacing holds at the detector, not in the patient)",
    ),
    (
        "without a place",
        "export the original slices, with ImagePositionPatient and ImageOrientationPatient, or "
        "planes of TIFF or PNG with --spacing-um z,y,x",
    ),
    (
        "with several frames but no place",
        "export single slices or an enhanced image, which states the place of each frame",
    ),
    (
        "compressed",
        "export the images uncompressed (Explicit VR Little Endian)",
    ),
    ("deflated", "export the images uncompressed (Explicit VR Little Endian)"),
    (
        "with a modality table",
        "export the images with RescaleSlope and RescaleIntercept",
    ),
    ("cut short", "copy the files again"),
)


def class_name(header: Any) -> str:
    """Return the name of a file's SOP class in the standard's words; empty: a private class."""
    kind = UID(str(header.get("SOPClassUID", "")))
    return kind.name if kind.name != kind else ""  # the name of a private UID is the UID


def remedy_for(header: Any, kind: FrameKind, reason: str) -> str:
    """Return what a file that is left out is, and a remedy; empty: not known.

    reason  why it is left out
    """
    is_image = not reason.startswith("without pixels")
    name = class_name(header)
    if is_image and kind.role in _ROLES:
        return _ROLES[kind.role]
    by_class = next((text for pattern, text in _CLASSES if pattern.search(name)), "")
    has_no_place = reason.startswith(
        ("without pixels", "without a place", "in colour", "with several frames")
    )
    if by_class and has_no_place:
        return by_class
    return next((text for start, text in _REASONS if reason.startswith(start)), "")


def in_words(remedies: Sequence[str], most: int = 3) -> str:
    """Return the different remedies as the end of a message."""
    return "".join(f"; {one}" for one in list(dict.fromkeys(filter(None, remedies)))[:most])
