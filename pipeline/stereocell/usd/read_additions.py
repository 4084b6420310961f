"""Read the meshes and curves that a layer adds to a specimen: arrows, labels, implants, electrodes.

Additions may stand anywhere below /Specimen. They are read in world um, at the default time. Only
plain values of a material are used, no images. Without a material, an addition has its display
colour. Curves become tubes.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from stereocell.formats.gltf import Material
from stereocell.meshes.tubes import sweep_tubes
from stereocell.model.mesh import Mesh
from stereocell.usd.drawn_prims import is_visible, to_world
from stereocell.usd.layer_opinions import defined_prims
from stereocell.usd.read_appearances import WHITE, material_of, surface_of
from stereocell.usd.read_attributes import require_still, value_of
from stereocell.usd.read_curves import curve_lines
from stereocell.usd.read_display import display_color, display_opacity, has_many_display_colors
from stereocell.usd.read_mesh import move_mesh, read_mesh
from stereocell.usd.read_textures import maps_of
from stereocell.usd.specimen import specimen_of
from stereocell.usd.typed_values import read_as

_GREY = (0.5, 0.5, 0.5)  # linear RGB of additions without a material and a display colour
_POLYGONAL = ("none", "bilinear")  # subdivision schemes that keep edges sharp
_Types = Sdf.ValueTypeNames


@dataclass(frozen=True, slots=True)
class Addition:
    """A mesh or curves that a user's layer adds to the specimen.

    path  path of the prim; it is unique
    name  display name, or else the name of the prim
    mesh  the surface, in world um
    """

    path: str
    name: str
    mesh: Mesh
    material: Material


def is_addition(prim: Usd.Prim) -> bool:
    """Return whether a prim is a mesh or curves below /Specimen, but not a channel's surface."""
    path, specimen = prim.GetPath(), specimen_of(prim.GetStage())
    is_drawn = prim.IsA(UsdGeom.Mesh) or prim.IsA(UsdGeom.BasisCurves)
    return (
        bool(is_drawn) and path.HasPrefix(specimen.root) and not _is_surface(path, specimen.tiles)
    )


def read_additions(stage: Usd.Stage) -> Iterator[Addition]:
    """Yield the visible additions that have faces, in the stage's order.

    Raises StageError for values that can't be drawn.
    """
    for prim in _additions(stage):
        mesh = _read(prim)
        if mesh is not None:
            name = str(prim.GetDisplayName() or prim.GetName())
            yield Addition(str(prim.GetPath()), name, mesh, _material(prim))


def notes_on_additions(stage: Usd.Stage) -> Iterator[str]:
    """Yield a message for each image and subdivision that is lost, and for each empty addition."""
    for prim in _additions(stage):
        if not _has_faces(prim):
            yield f"{prim.GetTypeName()} {prim.GetPath()} is not taken over: it has no faces"
            continue
        if _is_subdivided_by_default(prim):
            yield (
                f"subdivision of {prim.GetPath()}, which is USD's default, is not taken over: "
                "apply it and export points, or set subdivisionScheme to none"
            )
        surface = _surface(prim)
        for file in maps_of(surface).files if surface else ():
            yield (
                f"image {file.name} of {prim.GetPath()} is not taken over: the viewer draws added "
                "meshes without images"
            )


def _is_subdivided_by_default(prim: Usd.Prim) -> bool:
    """Return whether other programs subdivide a mesh because it states no subdivision scheme.

    Subdivision is USD's default. Most programs treat a mesh that has normals as polygonal, though.
    """
    if not prim.IsA(UsdGeom.Mesh):
        return False
    mesh = UsdGeom.Mesh(prim)
    has_normals = mesh.GetNormalsAttr().HasAuthoredValue() or prim.HasAttribute("primvars:normals")
    return not has_normals and not mesh.GetSubdivisionSchemeAttr().HasAuthoredValue()


def _additions(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    for prim in defined_prims(stage):
        if is_addition(prim) and is_visible(prim):
            yield prim


def _is_surface(path: Sdf.Path, tiles: Sdf.Path) -> bool:
    """Return whether a path is that of a channel's surface in a tile."""
    names = str(path.MakeRelativePath(tiles)).split("/") if path.HasPrefix(tiles) else []
    return len(names) == 3 and names[2] == f"{names[1]}_{names[0]}"


def _has_faces(prim: Usd.Prim) -> bool:
    name = "faceVertexCounts" if prim.IsA(UsdGeom.Mesh) else "curveVertexCounts"
    return bool(read_as(prim.GetAttribute(name), _Types.IntArray))


def _read(prim: Usd.Prim) -> Mesh | None:
    if not _has_faces(prim):
        return None
    matrix = to_world(prim)
    if prim.IsA(UsdGeom.Mesh):
        shown = {"displayColor"} if _shows_many_colors(prim) else set()
        faces = read_mesh(UsdGeom.Mesh(prim), matrix, shown=shown)
        return _facet(faces) if faces is not None and _is_faceted(prim) else faces
    curves = UsdGeom.BasisCurves(prim)
    require_still(curves.GetPointsAttr(), curves.GetWidthsAttr())
    value_of(prim, "points", _Types.Point3fArray)
    mesh = sweep_tubes(curve_lines(curves))
    return None if mesh is None else move_mesh(mesh, matrix)


def _is_faceted(prim: Usd.Prim) -> bool:
    """Return whether USD shades a mesh flat: it is polygonal and has no normals."""
    mesh = UsdGeom.Mesh(prim)
    is_polygonal = mesh.GetSubdivisionSchemeAttr().Get() in _POLYGONAL
    has_normals = (
        mesh.GetNormalsAttr().HasValue() or prim.GetAttribute("primvars:normals").HasValue()
    )
    return is_polygonal and not has_normals


def _facet(mesh: Mesh) -> Mesh:
    """Return a flat-shaded copy of a mesh: no two triangles share vertices."""
    corners = mesh.triangles.ravel()
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return Mesh(
        mesh.positions[corners],
        np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        np.repeat(normals, 3, axis=0).astype(np.float32),
        colors=None if mesh.colors is None else mesh.colors[corners],
    )


def _surface(prim: Usd.Prim) -> UsdShade.Shader | None:
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    return surface_of(prim) if material else None


def _shows_many_colors(prim: Usd.Prim) -> bool:
    return _surface(prim) is None and has_many_display_colors(prim)


def _material(prim: Usd.Prim) -> Material:
    surface = _surface(prim)
    if surface is not None:
        material = material_of(surface)
    elif _shows_many_colors(prim):
        material = Material(WHITE)
    else:
        material = Material(display_color(prim) or _GREY)
    return replace(material, opacity=material.opacity * display_opacity(prim, None))
