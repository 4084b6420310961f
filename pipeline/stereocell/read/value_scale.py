"""Packed values: scale, offset, sign and fill values by the CF conventions.

netCDF, xarray and many writers of HDF5 and Zarr store integers and state beside them how they
become measured values: `scale_factor * stored + add_offset`. `_FillValue`, `missing_value` and
`valid_range` name stored values that mark missing measurements. They are read as NaN, which
read/unmeasured.py replaces with the smallest finite value. `_Unsigned` states the true sign of
integers whose type has the wrong one.

References: CF conventions 1.11, sections 2.5.1 and 8.1; NetCDF Users Guide, attribute conventions.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.dataset import StoredArray
from stereocell.read.rescale import dtype_for, rescale
from stereocell.read.stated_numbers import number_of, numbers_of
from stereocell.read.stated_texts import text_of

_FILLS = ("_FillValue", "missing_value")
_SEPARATORS = re.compile(r"[,;\s]+")
ATTRIBUTES = (
    *("scale_factor", "add_offset", "_Unsigned"),
    *(*_FILLS, "valid_range", "valid_min", "valid_max"),
)


@dataclass(frozen=True, slots=True)
class ValueScale:
    """The rule by which stored numbers become values.

    slope, intercept  value = slope * stored + intercept
    signed     whether the stored integers are signed, where their type states the opposite
    missing    stored values that mark missing measurements
    low, high  range of the stored values that are measurements
    notes      a sentence on each attribute that is applied, or that can't be
    """

    slope: float = 1.0
    intercept: float = 0.0
    signed: bool | None = None
    missing: tuple[float, ...] = ()
    low: float = -np.inf
    high: float = np.inf
    notes: tuple[str, ...] = ()

    @property
    def has_gaps(self) -> bool:
        """Whether some stored values mark missing measurements."""
        return bool(self.missing) or self.low > -np.inf or self.high < np.inf

    @property
    def is_plain(self) -> bool:
        """Whether the stored numbers are the values themselves."""
        is_same = (self.slope, self.intercept) == (1.0, 0.0) and self.signed is None
        return is_same and not self.has_gaps


def scaled(
    where: str, array: StoredArray, attributes: Mapping[str, Any]
) -> tuple[StoredArray, tuple[str, ...]]:
    """Return the array with the values that its attributes define, and notes.

    attributes  values of ATTRIBUTES; None or missing: the array has no such attribute

    Raises SourceError where a stated factor is not a finite number.
    """
    scale = scale_of(where, np.dtype(array.dtype), attributes)
    if scale.is_plain:
        return array, scale.notes
    return ScaledArray(array, scale), scale.notes


def ignored_note(of: str, attributes: Mapping[str, Any]) -> str:
    """Return a sentence on factors in the attributes of a group; empty: there are none.

    CF defines factors for the array that has them, so those of a group are not applied.
    """
    stated = {name: attributes.get(name) for name in ("scale_factor", "add_offset")}
    named = [f"{name} {value}"[:40] for name, value in stated.items() if value is not None]
    if not named:
        return ""
    return (
        f"values: {' and '.join(named)} of {of} are not applied, because they count only as "
        "attributes of the array itself"
    )


def scale_of(where: str, stored: np.dtype[Any], attributes: Mapping[str, Any]) -> ValueScale:
    """Return the rule by which an array with these attributes stores its values."""
    slope, intercept = (
        _factor(where, name, attributes.get(name), default)
        for name, default in (("scale_factor", 1.0), ("add_offset", 0.0))
    )
    notes = []
    if (slope, intercept) != (1.0, 0.0):
        notes.append(
            f"values: scale_factor {slope:g} and add_offset {intercept:g} are applied to the "
            f"stored {stored.name}"
        )
    scale = replace(_sign(stored, attributes, notes), slope=slope, intercept=intercept)
    scale = _gaps(stored, scale, attributes, notes)
    return replace(scale, notes=tuple(notes))


def _factor(where: str, name: str, value: Any, default: float) -> float:
    if value is None:
        return default
    found = numbers_of(np.ravel(value))
    if len(found) != 1 or not np.isfinite(found[0]) or (name == "scale_factor" and not found[0]):
        raise SourceError(
            f"{where}: {name}: found {str(value)!r:.40}, expected one finite number other than "
            "0: correct the attribute, or remove it to read the voxels as they are stored"
        )
    return found[0]


def _sign(stored: np.dtype[Any], attributes: Mapping[str, Any], notes: list[str]) -> ValueScale:
    """Return a scale with the sign that `_Unsigned` states for the integers."""
    stated = attributes.get("_Unsigned", "")
    stated_text = (text_of(stated) or str(stated)).lower()
    other = {"i": "true", "u": "false"}.get(stored.kind)
    if stated_text != other or stored.itemsize > 4:
        return ValueScale()
    notes.append(
        f"_Unsigned = {stated_text!r}: the stored {stored.name} are read with the other sign"
    )
    return ValueScale(signed=stored.kind == "u")


def _gaps(
    stored: np.dtype[Any], scale: ValueScale, attributes: Mapping[str, Any], notes: list[str]
) -> ValueScale:
    """Return a scale with the stored values that mark missing measurements."""
    if stored.kind == "b":
        return scale
    fills: dict[str, tuple[float, ...]] = {}
    for name in _FILLS:
        found = _stored_values(stored, scale, attributes.get(name))
        if found := tuple(value for value in found if np.isfinite(value)):
            fills[name] = found
        elif _is_unread(attributes.get(name)):
            notes.append(
                f"values: {name} is {_shown(attributes[name])}, which is not a number: it is not "
                "used"
            )
    missing = tuple(dict.fromkeys(value for values in fills.values() for value in values))
    if stored.kind in "iu" and scale.slope > 0 and missing == (_least(stored, scale),) == (0.0,):
        missing, fills = (), {}  # this mark, 0, is the smallest value, as which it would be read
    low, high = _range(stored, scale, attributes)
    shown = [f"{name} {', '.join(f'{v:g}' for v in values)}" for name, values in fills.items()]
    if low > -np.inf or high < np.inf:
        ends = [f"below {low:g}"] * (low > -np.inf) + [f"above {high:g}"] * (high < np.inf)
        shown.append(f"stored values {' and '.join(ends)}, by the valid range")
    if shown:
        notes.append(
            f"values: voxels of {', or of '.join(shown)} are not measurements: they are read as "
            "the smallest measured value"
        )
    return replace(scale, missing=missing, low=low, high=high)


def _range(
    stored: np.dtype[Any], scale: ValueScale, attributes: Mapping[str, Any]
) -> tuple[float, float]:
    """Return the stated range of measured values, or infinity where it excludes no number."""
    both, low, high = (
        _limits(stored, scale, attributes.get(name))
        for name in ("valid_range", "valid_min", "valid_max")
    )
    low, high = (both[:1], both[1:]) if len(both) == 2 else (low, high)
    found = [
        ends[0] if len(ends) == 1 and np.isfinite(ends[0]) else default
        for ends, default in ((low, -np.inf), (high, np.inf))
    ]
    if found[0] >= found[1]:
        return -np.inf, np.inf
    if stored.kind in "iu":
        limits = np.iinfo(_resigned(stored, scale))
        found[0] = found[0] if found[0] > limits.min else -np.inf
        found[1] = found[1] if found[1] < limits.max else np.inf
    return found[0], found[1]


def _limits(stored: np.dtype[Any], scale: ValueScale, value: Any) -> tuple[float, ...]:
    """Return the ends of a range as stored values.

    By the NetCDF Users Guide, a range of real numbers for stored integers refers to the measured
    values.
    """
    found = _stored_values(stored, scale, value)
    is_measured = stored.kind in "iu" and np.asarray(value).dtype.kind == "f"
    if not is_measured or (scale.slope, scale.intercept) == (1.0, 0.0):
        return found
    ends = [(number - scale.intercept) / scale.slope for number in found]
    return tuple(sorted(ends))


def _stored_values(stored: np.dtype[Any], scale: ValueScale, value: Any) -> tuple[float, ...]:
    """Return an attribute's numbers with the sign of the voxels; empty: it states no number."""
    numbers = np.ravel(np.asarray(() if value is None else value))
    if numbers.dtype.kind in "SUO":  # numbers as texts, such as "-9999" or "0, 4095"
        return tuple(numbers_of(_SEPARATORS.split(" ".join(map(_text, numbers)).strip("[]() "))))
    if scale.signed is not None and numbers.dtype == stored:
        numbers = numbers.view(_resigned(stored, scale))
    try:
        return tuple(number_of(number) for number in numbers)
    except (TypeError, ValueError):
        return ()


def _is_unread(value: Any) -> bool:
    """Return whether an attribute that should be a number is a text without numbers."""
    texts = [_text(one) for one in np.ravel(np.asarray(value))] if value is not None else []
    return any(texts) and not numbers_of(texts)


def _shown(value: Any) -> str:
    return repr(", ".join(_text(one) for one in np.ravel(np.asarray(value))))[:40]


def _text(value: Any) -> str:
    return str(value.decode("utf-8", "replace") if isinstance(value, bytes) else value).strip()


def _least(stored: np.dtype[Any], scale: ValueScale) -> float:
    return float(np.iinfo(_resigned(stored, scale)).min)


def _resigned(stored: np.dtype[Any], scale: ValueScale) -> np.dtype[Any]:
    """Return the dtype of the stored bits with the sign that the file states."""
    if scale.signed is None:
        return stored
    return np.dtype(f"{stored.byteorder}{'i' if scale.signed else 'u'}{stored.itemsize}")


class ScaledArray:
    """An array whose values are computed from stored numbers by a ValueScale."""

    def __init__(self, array: StoredArray, scale: ValueScale) -> None:
        self.shape, self.chunks = tuple(array.shape), tuple(array.chunks)
        self._array, self._scale = array, scale
        self.dtype = dtype_of_values(np.dtype(array.dtype), scale)

    @property
    def stored(self) -> StoredArray:
        """The array of stored numbers."""
        return self._array

    def __getitem__(self, key: Any) -> NDArray[Any]:
        return values_of(np.asarray(self._array[key]), self._scale, self.dtype)


def dtype_of_values(stored: np.dtype[Any], scale: ValueScale) -> np.dtype[Any]:
    """Return the dtype of the values of stored numbers."""
    stored = _resigned(stored, scale)
    if scale.has_gaps or stored.kind not in "iu":
        return np.dtype(np.float64 if stored.itemsize > 4 else np.float32)
    if (scale.slope, scale.intercept) == (1.0, 0.0):
        return stored
    limits = np.iinfo(stored)
    return dtype_for([(float(limits.min), float(limits.max), scale.slope, scale.intercept)])


def values_of(stored: NDArray[Any], scale: ValueScale, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return the values of stored numbers in `dtype`; NaN where a measurement is missing."""
    signed = _resigned(stored.dtype, scale)
    if stored.dtype != signed:
        stored = stored.view(signed)
    if stored.dtype.kind == "b":
        stored = stored.astype(np.uint8)
    values = rescale(stored, scale.slope, scale.intercept, dtype)
    if not scale.has_gaps:
        return values
    is_gap = (stored < scale.low) | (stored > scale.high)
    # a float's fill value was rounded to the type as well
    kind = signed.type if signed.kind == "f" else float
    for missing in scale.missing:
        is_gap |= stored == kind(missing)
    return np.where(is_gap, values.dtype.type(np.nan), values)
