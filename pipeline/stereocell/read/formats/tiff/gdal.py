"""Read value scale and missing value from the tags that GDAL writes into TIFF.

GDAL_METADATA holds XML with a factor and an offset for each sample: `SCALE * stored + OFFSET`.
GDAL_NODATA holds the stored number that marks missing measurements.

References: https://gdal.org/drivers/raster/gtiff.html
"""

import math
from typing import Any
from xml.etree import ElementTree

import numpy as np
from tifffile import TiffPage

from stereocell.read.value_scale import ValueScale

_METADATA, _NODATA = 42112, 42113  # TIFF tags GDAL_METADATA and GDAL_NODATA
_MAX_CHARACTERS = 1 << 20


def gdal_scale(page: TiffPage) -> ValueScale:
    """Return the scale that a page's tags state, with its notes."""
    factors = _factors(page.tags.valueof(_METADATA))
    notes = []
    if len(set(factors)) > 1:
        notes.append(
            "values: SCALE and OFFSET of GDAL_METADATA differ by sample: the voxels are read as "
            "stored"
        )
    slope, intercept = factors[0] if len(set(factors)) == 1 else (1.0, 0.0)
    stored = np.dtype(page.dtype)
    if (slope, intercept) != (1.0, 0.0):
        notes.append(
            f"values: SCALE {slope:g} and OFFSET {intercept:g} of GDAL_METADATA are applied to the "
            f"stored {stored.name}"
        )
    missing = _missing(page.tags.valueof(_NODATA), stored)
    if missing:
        notes.append(
            f"values: voxels of GDAL_NODATA {missing[0]:g} are not measurements: they are read as "
            "the smallest measured value"
        )
    return ValueScale(slope=slope, intercept=intercept, missing=missing, notes=tuple(notes))


def _factors(text: Any) -> list[tuple[float, float]]:
    """Return factor and offset of each sample; empty: there are none, or the XML is not GDAL's."""
    if not isinstance(text, str) or "<!" in text or len(text) > _MAX_CHARACTERS:
        return []
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, RecursionError):
        return []
    found: dict[str, dict[str, float]] = {}
    for item in root.iter("Item"):
        if item.get("role") in ("scale", "offset"):
            value = _number(item.text)
            if value is not None and (value or item.get("role") == "offset"):
                found.setdefault(item.get("sample", "0"), {})[item.get("role", "")] = value
    return [(one.get("scale", 1.0), one.get("offset", 0.0)) for one in found.values()]


def _missing(text: Any, stored: np.dtype[Any]) -> tuple[float, ...]:
    """Return the number that marks missing measurements, if the voxels can have it."""
    value = _number(text)
    if value is None:
        return ()
    if stored.kind in "iu":
        limits = np.iinfo(stored)
        if not value.is_integer() or not limits.min <= value <= limits.max or value == limits.min:
            return ()  # no voxel can have this number, or it already is the smallest one
    return (value,)


def _number(text: Any) -> float | None:
    try:
        value = float(str(text).strip(" \0"))
    except ValueError:
        return None
    return value if math.isfinite(value) else None
