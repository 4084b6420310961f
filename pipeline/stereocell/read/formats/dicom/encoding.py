"""Read how a DICOM frame stores its values: bits, sign, rescale or table, padding.

References: DICOM PS3.3 C.7.6.3 (Image Pixel module), C.7.5.1.1.2 (Pixel Padding).
"""

import math
from collections.abc import Sequence
from typing import Any

from stereocell.read.formats.dicom.frame import Encoding
from stereocell.read.formats.dicom.frame_offsets import is_dose
from stereocell.read.formats.dicom.header_values import find_value
from stereocell.read.formats.dicom.modality_table import ModalityTable, ModalityTableError, table_of
from stereocell.read.formats.dicom.no_plane import NoPlaneError
from stereocell.read.formats.dicom.segmentation import FRACTIONAL
from stereocell.read.formats.dicom.value_scale import ValueScale


def encoding_of(
    header: Any,
    groups: Sequence[Any],
    is_inverted: bool,
    is_float: bool,
    scale: ValueScale,
) -> Encoding:
    """Return how a frame stores its values. Raises NoPlaneError for values that can't be read."""
    sequence = "PixelValueTransformationSequence"
    slope = find_value(header, groups, sequence, "RescaleSlope")
    intercept = find_value(header, groups, sequence, "RescaleIntercept")
    if not scale.has_rescale and scale.real_world is not None:
        slope, intercept = scale.real_world
    if slope is None and is_dose(header):
        slope = header.get("DoseGridScaling")
    if header.get("SegmentationType") == FRACTIONAL:
        slope = 1 / float(header.get("MaximumFractionalValue") or 255)
    slope, intercept = (1.0 if slope is None else float(slope)), float(intercept or 0.0)
    if not (math.isfinite(slope) and math.isfinite(intercept)) or slope == 0:
        raise NoPlaneError("with an unusable rescale slope")
    allocated = int(header.get("BitsAllocated") or 0)
    table = _table(header)
    if is_float and table is not None:
        raise NoPlaneError("with a modality table for floats")
    if is_float:
        return Encoding(allocated, 0, 0, True, False, slope, intercept)
    bits = int(header.get("BitsStored") or allocated)
    high_bit = int(header["HighBit"].value if "HighBit" in header else bits - 1)
    if not 1 <= bits <= high_bit + 1 <= allocated:
        raise NoPlaneError(f"with {bits} bits up to bit {high_bit} of {allocated}")
    signed = bool(header.get("PixelRepresentation") or 0)
    padding = _padding(header)
    if table is not None:
        slope, intercept = 1.0, 0.0
    return Encoding(
        allocated, bits, high_bit, signed, is_inverted, slope, intercept, padding, table
    )


def _table(header: Any) -> ModalityTable | None:
    try:
        return table_of(header)
    except ModalityTableError as error:
        raise NoPlaneError(str(error)) from None


def _padding(header: Any) -> tuple[int, int] | None:
    """Return the lowest and highest padding value, encoded as the pixels are; None: not stated.

    References: DICOM PS3.3 C.7.5.1.1.2.
    """
    ends = []
    for key in ("PixelPaddingValue", "PixelPaddingRangeLimit"):
        value = header.get(key)
        if isinstance(value, bytes) and len(value) == 2:  # pydicom returns bytes for an unknown VR
            little = header.original_encoding[1]
            value = int.from_bytes(value, "little" if little else "big")
        if isinstance(value, int):
            ends.append(value)
        elif not ends:
            return None
    if header.get("PixelRepresentation"):  # pixels are signed; the VR may have stated otherwise
        ends = [((end + 0x8000) & 0xFFFF) - 0x8000 for end in ends]
    else:
        ends = [end & 0xFFFF for end in ends]
    return min(ends), max(ends)
