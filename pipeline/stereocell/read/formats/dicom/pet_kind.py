"""The kind of a PET frame: attenuation correction, projection, and time point.

References: DICOM PS3.3 C.8.9.1 (PET Series module), C.8.9.4 (PET Image module), C.8.22.5.4 (PET
Frame Correction Factors).
"""

import re
from collections.abc import Sequence
from typing import Any

from stereocell.read.formats.dicom.header_values import find_number, find_text, find_words

NOT_CORRECTED = "not attenuation corrected"  # words for the user
PET_TAGS: list[Any] = [
    "CorrectedImage",
    "AttenuationCorrectionMethod",
    "AttenuationCorrected",
    "SeriesDescription",
    "SeriesType",
    "ImageIndex",
    "NumberOfSlices",
]
# Words of a free description. Only their presence is used; the text is not stored.
_WITHOUT = re.compile(
    r"\b(NAC|NO[ -]?AC|NON[ -]?AC|NON?[ -]?ATTENUATION|UNCORR(ECTED)?|WITHOUT AC|W/O AC)\b"
)
_WITH = re.compile(r"\b(AC|CTAC|MRAC|ATTENUATION CORR\w*|CORRECTED)\b")


def is_attenuation_corrected(header: Any, groups: Sequence[Any]) -> bool | None:
    """Return whether PET is corrected for attenuation; None: not stated.

    CorrectedImage lists the corrections. Without it, the flag of enhanced images and the method
    count, and then words of the series description.
    """
    words = find_words(header, groups, "CorrectedImage")
    if words:
        return "ATTN" in words
    flag = find_text(
        header, groups, "PETFrameCorrectionFactorsSequence", "AttenuationCorrected"
    ).upper()
    if flag in ("YES", "NO"):
        return flag == "YES"
    method = find_text(header, groups, "", "AttenuationCorrectionMethod").upper()
    if method:
        return method != "NONE"
    description = find_text(header, groups, "", "SeriesDescription").upper().replace("_", " ")
    if _WITHOUT.search(description):
        return False
    return True if _WITH.search(description) else None


def is_reprojection(header: Any, groups: Sequence[Any]) -> bool:
    """Return whether a PET image is a projection of the volume (SeriesType)."""
    return "REPROJECTION" in find_words(header, groups, "SeriesType")


def time_slice(header: Any, groups: Sequence[Any]) -> float | None:
    """Return the number of the volume in a dynamic or gated series, from 0.

    ImageIndex counts the slices of the first volume, then those of the second, and so on.
    """
    index = find_number(header, groups, "", "ImageIndex")
    slices = find_number(header, groups, "", "NumberOfSlices")
    if not index or not slices or index < 1 or slices < 1:
        return None
    return float((index - 1) // slices)
