"""The scale of a DICOM frame's values, as its header states it.

Stored values become grey values by RescaleSlope and RescaleIntercept. Without them a linear
RealWorldValueMapping is used, and without that the stored values themselves.

References: DICOM PS3.3 C.11.1 (Modality LUT), C.7.6.16.2.11 (Real World Value Mapping), C.8.9.1.1.3
(Units of PET).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from stereocell.read.formats.dicom.header_values import (
    find_number,
    find_text,
    first_item,
    private_number,
    private_tags,
)
from stereocell.read.formats.dicom.silence_logs import DICOM_FAULTS

_RESCALE = "PixelValueTransformationSequence"
_MAPPING = "RealWorldValueMappingSequence"
HOUNSFIELD = "HU"
UNKNOWN_KIND = "unknown"  # replaces free text, which notes must not quote
# values of PET's Units, and of DoseUnits
_UNITS = (
    "CNTS",
    "CPS",
    "PROPCNTS",
    "PROPCPS",
    "BQML",
    "GML",
    "CM2ML",
    "1CM",
    "PCNT",
    "NONE",
    "GY",
    "RELATIVE",
)
# values of RescaleType
_TYPES = (HOUNSFIELD, "US", "OD", "PCT", "MGML", "HU_MOD", "Z_EFF", "ED", "EDW")
# UCUM codes of a RealWorldValueMapping, in capitals -> Units; enhanced PET states no Units
_UCUM = {
    "BQ/ML": "BQML",
    "{COUNTS}": "CNTS",
    "{COUNTS}/S": "CPS",
    "G/ML": "GML",
    "G/ML{SUVBW}": "GML",
    "{SUVBW}G/ML": "GML",
    "CM2/ML": "CM2ML",
    "CM2/ML{SUVBSA}": "CM2ML",
    "{SUVBSA}CM2/ML": "CM2ML",
    "/CM": "1CM",
    "%": "PCNT",
}
_SUV_TYPES = ("BW", "BSA", "LBM", "LBMJAMES128", "LBMJANMA", "IBW")  # values of SUVType
_PHILIPS_SUV = (0x7053, 0x00, "PHILIPS PET PRIVATE GROUP", "IS")  # factor from counts to SUV
_PHILIPS = (0x2005, 0x0E, "PHILIPS MR IMAGING DD 001", "FL")  # scale slope
SCALE_TAGS: list[Any] = [
    "RescaleType",
    "Units",
    "DoseUnits",
    "SUVType",
    _MAPPING,
    *private_tags(*_PHILIPS[:2]),
    *private_tags(*_PHILIPS_SUV[:2]),
]


@dataclass(frozen=True, slots=True)
class ValueScale:
    """The statements in a header on the values of a frame.

    has_rescale  whether RescaleSlope or RescaleIntercept is stated
    kind         RescaleType, one of the standard's terms; UNKNOWN_KIND: another; empty: none
    units        units of PET or a dose, one of the standard's terms; empty: another, or none
    real_world   slope and intercept of the only RealWorldValueMapping; None: there is none
    philips      Philips's scale slope
    suv_type     SUVType of PET, one of the standard's terms; empty: another, or none
    suv_factor   Philips's factor from PET's values to standardized uptake values
    """

    has_rescale: bool = True
    kind: str = ""
    units: str = ""
    real_world: tuple[float, float] | None = None
    philips: float | None = None
    suv_type: str = ""
    suv_factor: float | None = None


def scale_of(header: Any, groups: Sequence[Any]) -> ValueScale:
    """Return the statements in a frame's header and functional groups."""
    slope = find_number(header, groups, _RESCALE, "RescaleSlope")
    intercept = find_number(header, groups, _RESCALE, "RescaleIntercept")
    kind = find_text(header, groups, _RESCALE, "RescaleType").upper()
    if header.get("ModalityLUTSequence"):
        kind = str(first_item(header.ModalityLUTSequence).get("ModalityLUTType") or "").upper()
    units = find_text(header, groups, "", "Units").upper()
    units = units or find_text(header, groups, "", "DoseUnits").upper()
    units = units or _mapped_units(header, groups)
    suv_type = find_text(header, groups, "", "SUVType").upper()
    return ValueScale(
        has_rescale=slope is not None or intercept is not None,
        kind=_kind(kind),
        units=units if units in _UNITS else "",
        real_world=_real_world(header, groups),
        philips=private_number(header, *_PHILIPS),
        suv_type=suv_type if suv_type in _SUV_TYPES else "",
        suv_factor=_suv_factor(header),
    )


def _suv_factor(header: Any) -> float | None:
    if str(header.get("Modality", "")).strip() != "PT":
        return None
    return private_number(header, *_PHILIPS_SUV)


def _kind(text: str) -> str:
    if text.startswith("HOUNSFIELD"):  # some exports write this word instead of HU
        return HOUNSFIELD
    return text if text in _TYPES or not text else UNKNOWN_KIND


def _mapped_units(header: Any, groups: Sequence[Any]) -> str:
    """Return Units from the code of the only RealWorldValueMapping; empty: another, or none."""
    try:
        for group in (*groups, header):
            mappings = None if group is None else group.get(_MAPPING)
            if mappings and len(mappings) == 1:
                code = first_item(first_item(mappings).get("MeasurementUnitsCodeSequence"))
                return _UCUM.get("" if code is None else str(code.get("CodeValue")).upper(), "")
    except DICOM_FAULTS:
        pass
    return ""


def _real_world(header: Any, groups: Sequence[Any]) -> tuple[float, float] | None:
    try:
        for group in (*groups, header):
            mappings = None if group is None else group.get(_MAPPING)
            # several mappings are for different ranges of values
            if not mappings or len(mappings) > 1:
                continue
            slope = find_number(first_item(mappings), (), "", "RealWorldValueSlope")
            intercept = find_number(first_item(mappings), (), "", "RealWorldValueIntercept")
            return (slope, intercept or 0.0) if slope else None
    except DICOM_FAULTS:
        pass
    return None
