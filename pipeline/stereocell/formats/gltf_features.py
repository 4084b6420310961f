"""Name the objects in a .glb: EXT_mesh_features, and a table by EXT_structural_metadata.

A vertex has the number of its object in the tile, `_FEATURE_ID_0`. glTF has no 32-bit vertex
attributes, so a file has at most 65 536 objects. The table has the labels of objects, and columns
by which other clients style and pick them (CesiumJS: `${volume_um3} > 500`). Every level of detail
repeats the table, so it is small.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.meshopt import CompressedBuffers
from stereocell.model.object_table import MISSING, Column

MAX_OBJECTS = 1 << 16  # largest number of objects in a file, which 16 bits can number
MAX_COLUMNS = 8  # largest number of columns in a file, without the label
_LABEL = "label"
_UNSIGNED_SHORT = 5123
_NO_NUMBER = float(np.finfo(np.float32).min)  # replaces NaN, which JSON does not have
_NO_CATEGORY = 0xFFFF
_ALIGNMENT = 8  # alignment of property tables in bytes


@dataclass(frozen=True, slots=True)
class Features:
    """A tile's objects in the order of their numbers in its meshes: labels and some columns."""

    labels: NDArray[np.uint64]
    columns: tuple[Column, ...]


def require_whole(
    objects: NDArray[np.int32],
    triangles: NDArray[np.uint32],
    name: str,
    features: Features | None,
) -> None:
    """Raise ValueError if an object has no number or row, or a triangle has two objects."""
    if len(objects) and (objects.min() < 0 or objects.max() >= MAX_OBJECTS):
        raise ValueError(
            f"{name} has objects {objects.min()} to {objects.max()}, expected at most "
            f"{MAX_OBJECTS} in a file: split the tile"
        )
    if features is not None and len(objects) and objects.max() >= len(features.labels):
        raise ValueError(
            f"{name} has objects up to {objects.max()}, but {len(features.labels)} rows, expected "
            "one row for each object"
        )
    owners = objects[triangles]
    if (owners != owners[:, :1]).any():
        raise ValueError(f"{name} has a triangle between two objects, expected separate vertices")


def add_feature_ids(buffers: CompressedBuffers, objects: NDArray[np.int32]) -> int:
    """Store each vertex's object; return the accessor's index."""
    rows = np.zeros((len(objects), 2), dtype=np.uint16)  # vertex strides are multiples of 4 bytes
    rows[:, 0] = objects
    return buffers.add_attribute(rows, {"componentType": _UNSIGNED_SHORT, "type": "SCALAR"})


def describe_features(
    buffers: CompressedBuffers, features: Features, channel: str
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Store the table; return the primitive's EXT_mesh_features, and EXT_structural_metadata.

    Raises ValueError for more than MAX_COLUMNS columns.
    """
    if len(features.columns) > MAX_COLUMNS:
        raise ValueError(f"{len(features.columns)} columns in a file, expected up to {MAX_COLUMNS}")
    count = len(features.labels)
    is_wide = count > 0 and int(features.labels.max()) > np.iinfo(np.uint32).max
    labels = features.labels.astype("<u8" if is_wide else "<u4")
    properties = {_LABEL: {"type": "SCALAR", "componentType": "UINT64" if is_wide else "UINT32"}}
    values = {_LABEL: labels.tobytes()}
    enums: dict[str, Any] = {}
    for column in features.columns:
        if column.categories:
            enums[column.id], values[column.id] = _enum(column)
            properties[column.id] = {"type": "ENUM", "enumType": column.id}
            properties[column.id] |= {"noData": enums[column.id]["values"][-1]["name"]}
        else:
            properties[column.id] = _number(column)
            known = np.where(np.isfinite(column.values), column.values, _NO_NUMBER)
            values[column.id] = known.astype("<f4").tobytes()
    table = {
        name: {"values": buffers.add(data, alignment=_ALIGNMENT)} for name, data in values.items()
    }
    schema: dict[str, Any] = {"id": f"objects_of_{channel}", "classes": {}}
    schema["classes"]["object"] = {"properties": properties}
    if enums:
        schema["enums"] = enums
    ids = {"featureCount": count, "attribute": 0, "propertyTable": 0}
    return (
        {"featureIds": [ids]},
        {
            "schema": schema,
            "propertyTables": [{"class": "object", "count": count, "properties": table}],
        },
    )


def _number(column: Column) -> dict[str, Any]:
    entry = {"name": column.name, "type": "SCALAR", "componentType": "FLOAT32"}
    if column.about:
        entry["description"] = column.about
    return {**entry, "noData": _NO_NUMBER}


def _enum(column: Column) -> tuple[dict[str, Any], bytes]:
    """Return the glTF enum of a column of categories and its values; the last one means missing."""
    missing = "none"
    while missing in column.categories:
        missing += "_"
    names = [*_distinct(column.categories), missing]
    codes = [*range(len(column.categories)), _NO_CATEGORY]
    listed = [{"name": name, "value": code} for name, code in zip(names, codes, strict=True)]
    known = np.where(column.values == MISSING, _NO_CATEGORY, np.nan_to_num(column.values))
    return (
        {"name": column.name, "valueType": "UINT16", "values": listed},
        known.astype("<u2").tobytes(),
    )


def _distinct(names: tuple[str, ...]) -> list[str]:
    """Return the names, made different from one another as an enum requires."""
    found: dict[str, None] = {}
    for name in names:
        while name in found:
            name += "_"
        found[name] = None
    return list(found)
