"""Words for image types, from a fixed table, because ImageType may hold free text.

References: DICOM PS3.3 C.7.6.1.1.2 (Image Type).
"""

from typing import NamedTuple

from stereocell.read.formats.dicom.frame import Frame

_ORIGINS = {"ORIGINAL": "original", "DERIVED": "derived"}
# words of ImageType in makers' documents -> words for the user
_DETAILS = {
    **dict.fromkeys(("NORM", "NORMALIZED", "SCIC", "PURE"), "intensity-normalized"),
    **dict.fromkeys(("DIS2D", "DIS3D", "GDC"), "distortion-corrected"),
    **dict.fromkeys(("MOCO", "MOTIONCORRECTION"), "motion-corrected"),
    **dict.fromkeys(("FIL", "FILTERED"), "filtered"),
    **dict.fromkeys(("COMPOSED", "COMP_SP", "COMP_AD", "STITCHED"), "composed of stations"),
    **dict.fromkeys(("SE", "SPIN ECHO"), "spin echo"),
    "FFE": "gradient echo",
    "IR": "inversion recovery",
    **dict.fromkeys(("TOF", "TOF2D", "TOF3D"), "time of flight"),
    **dict.fromkeys(("PCA", "PHASE CONTRAST"), "phase contrast"),
    "ASL": "arterial spin labelling",
    "DIFFUSION": "diffusion",
    "PERFUSION": "perfusion",
    "IODINE": "iodine",
    **dict.fromkeys(("VNC", "VIRTUAL_NON_CONTRAST"), "virtual non-contrast"),
    "DET_A": "detector A",
    "DET_B": "detector B",
    "DET_AB": "detectors A and B",
    "DYNAMIC": "dynamic",
    "GATED": "gated",
    "STATIC": "static",
    "HELIX": "helical scan",
}


class TypeValue(NamedTuple):
    """The image type of a frame. When sorted, images as acquired come before derived ones.

    contrasts   contrasts for the user
    is_derived  whether it was computed from other images
    words       ImageType, compared and never shown
    """

    contrasts: tuple[str, ...]
    is_derived: bool
    words: tuple[str, ...]


def type_of(frame: Frame) -> TypeValue:
    """Return the image type of a frame."""
    words = frame.kind.image_type
    return TypeValue(frame.kind.contrasts, words[:1] == ("DERIVED",), words)


def type_words(value: TypeValue, _: int) -> str:
    """Return the contrasts or the origin of an image type, and its details."""
    origin = _ORIGINS.get(value.words[0], "") if value.words else ""
    known = [_DETAILS[word] for word in value.words[2:] if word in _DETAILS]
    names = dict.fromkeys([*(value.contrasts or [origin or "unknown image type"]), *known])
    return ", ".join(names)
