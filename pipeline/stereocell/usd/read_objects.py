"""Read the objects of a composed stage: the object of each vertex, and the table's columns."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom

from stereocell.model.errors import StageError
from stereocell.model.mesh import Mesh
from stereocell.model.object_table import Column, SharedInterfaces
from stereocell.usd.layer import PAINTED_BY
from stereocell.usd.primvar_names import OBJECT_ID
from stereocell.usd.specimen import specimen_of
from stereocell.usd.typed_values import read_as, require_type, text_of
from stereocell.usd.write_objects import (
    COLUMN,
    COLUMNS,
    DEFAULT,
    HIDDEN,
    LABELS,
    NAMES,
    TOUCHING,
    WALL_UM2,
)

_Types = Sdf.ValueTypeNames


@dataclass(frozen=True, slots=True)
class TileObjects:
    """The objects of one tile, after all edits.

    labels    uint64 (n,), numbers in the label map
    names     name of each object; empty: the objects have no names
    values    float32 (n,) by column ID
    touching  interfaces of these objects; the first label of a pair is the object in this tile
    """

    labels: NDArray[np.uint64]
    names: tuple[str, ...]
    values: dict[str, NDArray[np.float32]]
    touching: SharedInterfaces


def read_columns(stage: Usd.Stage, channel_id: str) -> tuple[list[Column], str] | None:
    """Return a channel's columns without values, and the ID of the default column.

    Returns None if the channel has no objects. Raises StageError for a column without a name.
    """
    prim = stage.GetPrimAtPath(specimen_of(stage).channels.AppendChild(channel_id))
    ids = read_as(prim.GetAttribute(COLUMNS), _Types.TokenArray)
    if ids is None:
        return None
    columns = []
    for name in map(str, ids):
        attribute = prim.GetAttribute(f"{COLUMN}{name}")
        if not attribute:
            raise StageError(
                f"{prim.GetPath()}.{COLUMN}{name}: missing, expected an attribute for each name in "
                f"{COLUMNS}"
            )
        data = attribute.GetCustomData()
        categories = tuple(map(str, data.get("categories", ())))
        colors = _colors_of(attribute, data)
        if len(colors) != len(categories):
            raise StageError(
                f"{attribute.GetPath()}: found {len(colors)} colours, expected {len(categories)}, "
                "one for each category"
            )
        columns.append(
            Column(
                name,
                text_of(attribute) or name,
                np.zeros(0, np.float32),
                str(attribute.GetDocumentation()),
                str(data.get("unit", "")),
                categories,
                tuple((float(r), float(g), float(b)) for r, g, b in colors),
            )
        )
    return columns, text_of(prim.GetAttribute(DEFAULT))


def _colors_of(attribute: Usd.Attribute, data: dict[str, Any]) -> NDArray[np.float64]:
    """Return the colours (n, 3) of a column's categories, clipped to 0..1.

    n is 0 if the column states no colours. Raises StageError for a value of another type.
    """
    given = data.get("colors")
    if given is None:
        return np.zeros((0, 3))
    require_type(f"{attribute.GetPath()}: colors", given, _Types.Float3Array)
    return np.array(given, np.float64).reshape(-1, 3).clip(0, 1)


def shown_objects(mesh: Usd.Prim) -> NDArray[np.bool_] | None:
    """Return a mask (n,) of a tile's objects that no edit hides; None: the mesh has no objects."""
    labels = read_as(mesh.GetAttribute(LABELS), _Types.UInt64Array)
    if labels is None:
        return None
    stage, name = mesh.GetStage(), mesh.GetParent().GetName()
    channel = stage.GetPrimAtPath(specimen_of(stage).channels.AppendChild(name))
    hidden = read_as(channel.GetAttribute(HIDDEN), _Types.UInt64Array) if channel else None
    own, gone = (np.array(list(one or ()), np.uint64) for one in (labels, hidden))
    return ~np.isin(own, gone)


def without_hidden(mesh: Mesh, prim: Usd.Prim) -> Mesh | None:
    """Return a tile's mesh without hidden objects; None: all its objects are hidden."""
    shown = shown_objects(prim)
    if mesh.objects is None or shown is None or shown.all():
        return mesh
    kept = shown[mesh.objects]
    if not kept.any():
        return None
    number = (np.cumsum(kept) - 1).astype(np.uint32)
    parts: dict[str, Any] = {
        field.name: None if part is None else part[kept]
        for field in fields(mesh)
        if field.name not in ("triangles", "objects")
        for part in [getattr(mesh, field.name)]
    }
    triangles = mesh.triangles[kept[mesh.triangles[:, 0]]]
    objects = (np.cumsum(shown) - 1).astype(np.int32)[mesh.objects[kept]]
    return Mesh(triangles=number[triangles], objects=objects, **parts)


def read_tile_objects(mesh: Usd.Prim, columns: list[Column]) -> TileObjects | None:
    """Return the objects of a tile's mesh, at the selected level; None: it has no objects.

    Hidden objects are left out. Raises StageError if a column has the wrong number of values.
    """
    labels = read_as(mesh.GetAttribute(LABELS), _Types.UInt64Array)
    if labels is None:
        return None
    count = len(labels)
    names = tuple(map(str, read_as(mesh.GetAttribute(NAMES), _Types.StringArray) or ()))
    if names and len(names) != count:
        raise StageError(
            f"{mesh.GetPath()}.{NAMES}: found {len(names)} names, expected {count}, one for each "
            "object"
        )
    primvars = UsdGeom.PrimvarsAPI(mesh)
    values = {}
    for column in columns:
        primvar = primvars.GetPrimvar(column.id)
        given = read_as(primvar.GetAttr(), _Types.FloatArray, may_be_nan=True) if primvar else None
        found = np.array([] if given is None else given, np.float32)
        if given is not None and found.shape != (count,):
            raise StageError(
                f"{mesh.GetPath()}.primvars:{column.id}: found {len(found)} values, expected "
                f"{count}, one for each object"
            )
        values[column.id] = found if given is not None else np.full(count, np.nan, np.float32)
        if column.categories:
            codes = values[column.id]
            is_known = (codes >= 0) & (codes < len(column.categories))
            values[column.id] = np.where(is_known, codes, -1).astype(np.float32)
    touching = read_as(mesh.GetAttribute(TOUCHING), _Types.UInt64Array)
    pairs = np.array(list(touching or ()), np.uint64)
    if len(pairs) % 2:
        raise StageError(
            f"{mesh.GetPath()}.{TOUCHING}: found {len(pairs)} labels, expected an even number, "
            "since two objects touch"
        )
    # Stages of earlier versions do not have the areas.
    given = read_as(mesh.GetAttribute(WALL_UM2), _Types.FloatArray, may_be_nan=True)
    areas = np.full(len(pairs) // 2, np.nan) if given is None else given
    if len(areas) != len(pairs) // 2:
        raise StageError(
            f"{mesh.GetPath()}.{WALL_UM2}: found {len(areas)} areas, expected {len(pairs) // 2}, "
            "one for each interface"
        )
    shown = shown_objects(mesh)
    assert shown is not None
    return TileObjects(
        np.array(list(labels), np.uint64)[shown],
        tuple(name for name, is_shown in zip(names, shown, strict=False) if is_shown),
        {name: column[shown] for name, column in values.items()},
        SharedInterfaces(pairs.reshape(-1, 2), np.array(areas, np.float32)),
    )


def painter_of(stage: Usd.Stage, channel_id: str) -> str:
    """Return the ID of the channel that colours the objects by its intensity; empty: none."""
    channels = specimen_of(stage).channels
    path = channels.AppendChild(channel_id)
    name = text_of(stage.GetPrimAtPath(path).GetAttribute(PAINTED_BY))
    is_there = Sdf.Path.IsValidIdentifier(name) and stage.GetPrimAtPath(channels.AppendChild(name))
    return name if is_there else ""


def objects_of(mesh: UsdGeom.Mesh) -> NDArray[np.int64] | None:
    """Return the index of each face's object (m,); None: the mesh has no objects."""
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar(OBJECT_ID)
    if not primvar or primvar.GetInterpolation() != UsdGeom.Tokens.uniform:
        return None
    flat = primvar.ComputeFlattened()
    if flat is None:
        return None
    require_type(primvar.GetAttr().GetPath(), flat, _Types.IntArray)
    return np.array(flat, np.int64)
