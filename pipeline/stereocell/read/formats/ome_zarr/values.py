"""Convert the numbers of a Zarr array to values, by the attributes of CF and of xarray.

xarray stores `_FillValue` as the metadata's `fill_value` (Zarr v2), or as base64 in the attributes
(v3). In other arrays `fill_value` only stands for chunks that are not stored.
"""

import base64
import binascii
import struct
from collections.abc import Mapping
from typing import Any

from stereocell.read.dataset import VoxelArray
from stereocell.read.value_scale import ATTRIBUTES, scaled

_FILL = "_FillValue"


def with_values(
    where: str, level: VoxelArray, attributes: Mapping[str, Any] | None = None
) -> tuple[VoxelArray, tuple[str, ...]]:
    """Return an array of values, and notes.

    attributes  attributes of the finest level, which hold for all levels; None: the array's own

    Raises SourceError where a stated factor is not a finite number.
    """
    stored: Any = level.array
    own = attributes if attributes is not None else value_attributes(stored)
    values, notes = scaled(where, stored, own)
    return (level if values is stored else VoxelArray(values, level.axes)), notes


def value_attributes(array: Any) -> dict[str, Any]:
    """Return the attributes of an array that state how its values are stored."""
    stated = dict(array.attrs)
    found = {name: stated.get(name) for name in ATTRIBUTES}
    if isinstance(text := found[_FILL], str):
        found[_FILL] = value if (value := _decoded(text)) is not None else text
    is_xarrays = "_ARRAY_DIMENSIONS" in stated and array.metadata.zarr_format == 2
    if found[_FILL] is None and is_xarrays and array.fill_value:
        found[_FILL] = array.fill_value
    return found


def _decoded(text: str) -> float | None:
    """Return a fill value that xarray wrote as base64; None: the text is not one."""
    try:
        (value,) = struct.unpack("<d", base64.b64decode(text, validate=True))
    except (binascii.Error, struct.error, ValueError):
        return None
    return float(value)
