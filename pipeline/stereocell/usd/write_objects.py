"""Write the objects of a label map into a stage: the object of each face, and the table's columns.

Columns are indexed uniform primvars: one value per object, and one index per face. Blender would
read a constant array as values of the first points. Values that are repeated for each face would
take three times the bytes. Categories are numbers. Each category is also a GeomSubset with its own
material, which DCC tools show as a material slot.

The channel's prim has the meaning of the columns, see `write_columns`. That prim is a material, and
a material can't contain others, so the materials of classes are below CLASSES.
"""

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom, UsdShade, Vt

from stereocell.model.identifiers import to_identifier
from stereocell.model.mesh import Mesh
from stereocell.model.object_table import Column, ObjectTable, SharedInterfaces
from stereocell.objects.table import color_objects
from stereocell.usd.layer import CLASSES, set_attribute
from stereocell.usd.preview_surface import define_surface
from stereocell.usd.primvar_names import OBJECT_ID, PAINT

# Attributes of a tile's mesh
LABELS = "stereocell:objectLabels"  # number of each object in the label map
NAMES = "stereocell:objectNames"  # name of each object
TOUCHING = "stereocell:objectWalls"  # pairs of labels whose objects share an interface
WALL_UM2 = "stereocell:objectWallAreas"  # um^2, area of each of these interfaces
# Attributes of a channel's prim
HIDDEN = "stereocell:hiddenObjects"  # labels of objects that an edit hides
COLUMNS, DEFAULT = "stereocell:columns", "stereocell:defaultColumn"
COLUMN = "stereocell:column:"
MAX_CLASSES = 32  # most categories as GeomSubsets: each adds a prim to each level of each tile
_FAMILY = UsdShade.Tokens.materialBind

_Types = Sdf.ValueTypeNames


def class_name(column: Column, code: int) -> str:
    """Return the name of a category's prims: its GeomSubset and its material."""
    return f"class_{to_identifier(column.categories[code])}"


def classes_of(table: ObjectTable) -> Column | None:
    """Return the default column if its categories become GeomSubsets; else None."""
    column = table.column(table.default)
    return column if column is not None and 0 < len(column.categories) <= MAX_CLASSES else None


def write_columns(prim: Usd.Prim, table: ObjectTable) -> None:
    """Write the meaning of the columns of a channel's objects, and the materials of its classes."""
    ids = Vt.TokenArray([column.id for column in table.columns])
    set_attribute(prim, COLUMNS, _Types.TokenArray, ids, custom=True)
    set_attribute(prim, DEFAULT, _Types.Token, table.default, custom=True)
    for column in table.columns:
        name = f"{COLUMN}{column.id}"
        set_attribute(prim, name, _Types.String, column.name, custom=True)
        attribute = prim.GetAttribute(name)
        attribute.SetDocumentation(column.about)
        if column.unit:
            attribute.SetCustomDataByKey("unit", column.unit)
        if column.categories:
            attribute.SetCustomDataByKey("categories", Vt.StringArray(list(column.categories)))
            colors = np.array(column.colors, np.float32)
            attribute.SetCustomDataByKey("colors", Vt.Vec3fArray.FromNumpy(colors))
    classes = classes_of(table)
    if classes is not None:
        UsdGeom.Scope.Define(prim.GetStage(), CLASSES)
        UsdGeom.Scope.Define(prim.GetStage(), CLASSES.AppendChild(prim.GetName()))
    for code, color in enumerate(classes.colors if classes else ()):
        assert classes is not None
        path = CLASSES.AppendChild(prim.GetName()).AppendChild(class_name(classes, code))
        material = UsdShade.Material.Define(prim.GetStage(), path)
        material.GetPrim().SetDisplayName(classes.categories[code])
        define_surface(material, color)


def define_objects(
    mesh: UsdGeom.Mesh,
    look: Sdf.Path,
    channel_id: str,
    table: ObjectTable,
    touching: SharedInterfaces | None,
) -> None:
    """Write the objects' data for all levels of detail: labels, names, interfaces, classes.

    look      path of the mesh's material; those of the classes stand beside it
    touching  interfaces of these objects; None: not known
    """
    prim = mesh.GetPrim()
    set_attribute(prim, LABELS, _Types.UInt64Array, _uint64(table.labels), custom=True)
    if table.names:
        names = Vt.StringArray(list(table.names))
        set_attribute(prim, NAMES, _Types.StringArray, names, custom=True)
    if touching is not None:
        pairs = _uint64(touching.labels.ravel())
        set_attribute(prim, TOUCHING, _Types.UInt64Array, pairs, custom=True)
        areas = Vt.FloatArray.FromNumpy(touching.area_um2)
        set_attribute(prim, WALL_UM2, _Types.FloatArray, areas, custom=True)
    classes = classes_of(table)
    for code in range(len(classes.categories) if classes else 0):
        assert classes is not None
        name = class_name(classes, code)
        path = look.ReplaceName(f"{look.name}_{name}")
        material = UsdShade.Material.Define(prim.GetStage(), path)
        source = CLASSES.AppendChild(channel_id).AppendChild(name)
        material.GetPrim().GetInherits().AddInherit(source)
        define_surface(material, classes.colors[code])


def write_objects(
    mesh: UsdGeom.Mesh,
    look: Sdf.Path,
    made: Mesh,
    table: ObjectTable,
    kept: NDArray[np.int64],
) -> None:
    """Write the objects of one level: columns, colours and classes, as primvars and GeomSubsets.

    made  mesh as built, with vertices that are split along the seams of its UVs
    kept  indices of the vertices of `made` that are points of `mesh`
    """
    assert made.objects is not None
    of_face = made.objects[made.triangles[:, 0]].astype(np.int32)
    count = len(table.labels)
    primvars = UsdGeom.PrimvarsAPI(mesh)
    indices = Vt.IntArray.FromNumpy(of_face)
    ids = np.arange(count, dtype=np.int32)
    _write(primvars, OBJECT_ID, _Types.IntArray, Vt.IntArray.FromNumpy(ids), indices)
    for column in table.columns:
        if column.categories:
            codes = Vt.IntArray.FromNumpy(np.nan_to_num(column.values, nan=-1).astype(np.int32))
            _write(primvars, column.id, _Types.IntArray, codes, indices)
        else:
            values = np.ascontiguousarray(column.values, np.float32)
            _write(primvars, column.id, _Types.FloatArray, Vt.FloatArray.FromNumpy(values), indices)
    colors = np.ascontiguousarray(color_objects(table), np.float32)
    shown = Vt.Vec3fArray.FromNumpy(colors)
    _write(primvars, "displayColor", _Types.Color3fArray, shown, indices)
    if made.paint is not None:
        paint = primvars.CreatePrimvar(PAINT, _Types.FloatArray, UsdGeom.Tokens.vertex)
        paint.Set(Vt.FloatArray.FromNumpy(np.ascontiguousarray(made.paint[kept], np.float32)))
    classes = classes_of(table)
    if classes is not None:
        _write_classes(mesh, look, classes, of_face)


def _write_classes(
    mesh: UsdGeom.Mesh, look: Sdf.Path, column: Column, of_face: NDArray[np.int32]
) -> None:
    code_of_face = column.values[of_face].astype(np.int64)
    for code in range(len(column.categories)):
        faces = np.flatnonzero(code_of_face == code).astype(np.int32)
        if not len(faces):
            continue
        name = class_name(column, code)
        subset = UsdGeom.Subset.CreateGeomSubset(
            mesh, name, UsdGeom.Tokens.face, Vt.IntArray.FromNumpy(faces), _FAMILY
        )
        binding = UsdShade.MaterialBindingAPI.Apply(subset.GetPrim())
        path = look.ReplaceName(f"{look.name}_{name}")
        binding.Bind(UsdShade.Material.Get(mesh.GetPrim().GetStage(), path))
    UsdGeom.Subset.SetFamilyType(mesh, _FAMILY, UsdGeom.Tokens.nonOverlapping)


def _write(
    primvars: UsdGeom.PrimvarsAPI,
    name: str,
    kind: Sdf.ValueTypeName,
    values: object,
    indices: Vt.IntArray,
) -> None:
    primvar = primvars.CreatePrimvar(name, kind, UsdGeom.Tokens.uniform)
    primvar.Set(values)
    primvar.SetIndices(indices)


def _uint64(labels: NDArray[np.uint64]) -> Vt.UInt64Array:
    return Vt.UInt64Array(labels.tolist())
