"""Notes for the user on the values of DICOM: scales that differ, units, Hounsfield units.

A CT is in Hounsfield units if its rescale reaches far below water, where air lies. If the headers
leave it open, the values decide.
"""

from collections.abc import Callable, Sequence

from stereocell.model.counted import agreeing
from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.value_scale import HOUNSFIELD, UNKNOWN_KIND
from stereocell.read.statements import Statement, Subject, Trust, settle

_SCALE = Subject("value scale (slope, intercept)")
_AIR_HU = -500.0  # HU; a scale that reaches no lower can't show air, which has -1000 HU
_KIND_WORDS = {UNKNOWN_KIND: "not one of the standard's terms, such as HU"}
# Units of PET -> words for notes
_PET_UNITS = {
    "CNTS": "counts, not activity (Units CNTS)",
    "CPS": "counts per second (Units CPS)",
    "PROPCNTS": "proportional to counts (Units PROPCNTS)",
    "PROPCPS": "proportional to counts per second (Units PROPCPS)",
    "BQML": "becquerels per millilitre (Units BQML), not standardized uptake values",
    "GML": "standardized uptake values in grams per millilitre (Units GML)",
    "CM2ML": "standardized uptake values by body surface (Units CM2ML)",
    "1CM": "attenuation per centimetre (Units 1CM)",
    "PCNT": "percent (Units PCNT)",
    "NONE": "without unit (Units NONE)",
}

_DOSE_UNITS = {
    "GY": "in gray (DoseUnits GY)",
    "RELATIVE": "relative to a reference (DoseUnits RELATIVE)",
}


def reaches_air(frames: Sequence[Frame], lowest: Callable[[], float]) -> bool:
    """Return whether the values of a CT are Hounsfield units.

    lowest  returns the lowest grey value of a slice in the middle; called only if the headers leave
            the question open
    """
    if any(frame.scale.kind not in ("", HOUNSFIELD, UNKNOWN_KIND) for frame in frames):
        return False
    reach = 0.0
    for frame in frames:
        encoding = frame.encoding
        reach = min(reach, *encoding.grey_ends) if encoding.bits else -float("inf")
    if reach > _AIR_HU:
        return False
    if all(f.scale.has_rescale and f.encoding.intercept <= _AIR_HU for f in frames):
        return True
    return lowest() <= _AIR_HU


def scale_notes(frames: Sequence[Frame], *, is_hounsfield: bool) -> tuple[str, ...]:
    """Return a sentence for each thing that a user should know about the values.

    is_hounsfield  whether the values of a CT are Hounsfield units
    """
    first = frames[0]
    notes = list(_rescale_notes(frames))
    kinds = [_KIND_WORDS.get(kind, kind) for kind in _other_kinds(frames)]
    if first.modality == "CT" and not is_hounsfield:
        why = "" if first.scale.has_rescale else " (no RescaleSlope and no RescaleIntercept)"
        if kinds:
            why = f" (RescaleType is {kinds[0]})"
        notes.append(
            f"this CT states no Hounsfield units{why}: its iso-values and window are found as for "
            "any other volume (--iso-value and --window set them in voxel values; --as hounsfield "
            "treats the values as Hounsfield units)"
        )
    elif first.modality == "CT" and not first.scale.has_rescale:
        notes.append(
            "Hounsfield units are assumed, because the values reach those of air, although the "
            "CT states no RescaleIntercept (--iso-value and --window set other levels)"
        )
    if first.modality == "CT" and is_hounsfield and kinds:
        notes.append(
            f"RescaleType is {kinds[0]}: Hounsfield units are assumed, because the values reach "
            "those of air (--iso-value and --window set other levels)"
        )
    if first.modality == "PT":
        notes += _pet_notes(first)
    if first.modality == "RTDOSE":
        notes.append(_dose_note(first))
    if first.scale.philips is not None:
        notes.append(
            f"Philips states a scale slope of {first.scale.philips:.4g} (2005,100e) as well, which "
            "is not applied: values can only be compared within this series"
        )
    return tuple(notes)


def _pet_notes(first: Frame) -> list[str]:
    """Return notes on the unit of PET. No other unit is computed, such as SUV from activity."""
    scale = first.scale
    unit = _PET_UNITS.get(scale.units, "in an unknown unit (no Units)")
    by = f", SUVType {scale.suv_type}" if scale.suv_type and scale.units in ("GML", "CM2ML") else ""
    notes = [f"PET values are {unit}{by}"]
    if scale.suv_factor and scale.units != "GML":
        notes.append(
            f"Philips states a factor of {scale.suv_factor:.4g} from these values to standardized "
            "uptake values (7053,1000), which is not applied"
        )
    return notes


def _dose_note(first: Frame) -> str:
    if not first.scale.has_rescale and first.encoding.slope == 1:
        return "dose values are read as stored, without a unit: DoseGridScaling is not stated"
    return f"dose values are {_DOSE_UNITS.get(first.scale.units, 'in an unknown unit')}"


def _table_notes(frames: Sequence[Frame], tables: int) -> list[str]:
    """Return notes on values from a table, and on a rescale that the same file states."""
    with_table = sum(frame.encoding.table is not None for frame in frames)
    source = "separate tables" if tables > 1 else "a table"
    notes = [
        f"values of {with_table} of {len(frames)} images come from {source} (ModalityLUTSequence)"
    ]
    both = sum(frame.encoding.table is not None and frame.scale.has_rescale for frame in frames)
    if both:
        notes.append(
            f"{both} of {len(frames)} images {agreeing(both, 'states', 'state')} RescaleSlope and "
            "RescaleIntercept as well as the table: the table is used"
        )
    return notes


def _other_kinds(frames: Sequence[Frame]) -> list[str]:
    """Return the RescaleTypes of the frames other than Hounsfield units, sorted."""
    return sorted({frame.scale.kind for frame in frames} - {"", HOUNSFIELD})


def _rescale_notes(frames: Sequence[Frame]) -> list[str]:
    """Return notes on rescales that differ between frames, are missing in some, or contradict."""
    notes: list[str] = []
    encodings = [frame.encoding for frame in frames]
    for name, values in (
        ("RescaleSlope", {encoding.slope for encoding in encodings}),
        ("RescaleIntercept", {encoding.intercept for encoding in encodings}),
    ):
        if len(values) > 1:
            low, high = min(values), max(values)
            notes.append(
                f"{name} differs between images ({low:.4g} to {high:.4g}): each image has its own"
            )
    without = sum(not f.scale.has_rescale and f.encoding.table is None for f in frames)
    if 0 < without < len(frames):
        notes.append(
            f"{without} of {len(frames)} images {agreeing(without, 'states', 'state')} no rescale: "
            f"{agreeing(without, 'its', 'their')} stored values are used"
        )
    tables = {encoding.table for encoding in encodings if encoding.table is not None}
    if tables:
        notes += _table_notes(frames, len(tables))
        return notes
    mapped = next((frame for frame in frames if frame.scale.real_world is not None), None)
    if mapped is None or mapped.scale.real_world is None:
        return notes
    used = (mapped.encoding.slope, mapped.encoding.intercept)
    if not mapped.scale.has_rescale:
        slope, intercept = used
        return [
            *notes,
            f"values are scaled by RealWorldValueMapping (slope {slope:.4g}, intercept "
            f"{intercept:.4g})",
        ]
    rescale = Statement(used, "RescaleSlope")
    world = Statement(mapped.scale.real_world, "RealWorldValueMapping", Trust.REPEATED)
    return [*notes, *settle(_SCALE, [rescale, world]).notes]
