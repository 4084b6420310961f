"""Write objects that an artist added to the scene: meshes, curves, texts, cameras and lights.

`stereocell bundle` takes meshes as layers of the viewer, cameras as its views, and suns and points
as its lamps. Each object that has a surface becomes triangles: its shape at the current frame, with
its modifiers applied.
"""

import math
import re

import numpy as np
from mathutils import Matrix
from pxr import Gf, Sdf, UsdGeom, Vt

from .choice import ROOT
from .layer_values import set_value
from .lighting import color_of_light
from .looks import plain_values

ANNOTATIONS = f"{ROOT}/Annotations"
CAMERAS = f"{ROOT}/Cameras"
LIGHTS = f"{ROOT}/Lights"
_SURFACES = ("MESH", "CURVE", "SURFACE", "FONT", "META")
_Types = Sdf.ValueTypeNames


def write_additions(context, layer, stage, root, strangers, lost):
    """Write the objects that were not imported, and yield one line for each that was written.

    Reasons why an object, or a property of one, is not written are appended to `lost`. Hidden
    objects and empties, which only group other objects, are skipped.
    """
    to_stage = root.matrix_world.inverted()
    names = _Names(layer, stage)
    for block in strangers:
        if block.hide_render or not block.visible_get():
            continue
        if block.is_instancer:
            lost.append(f"instances by {block.name} are not taken over: make them real")
        if block.type == "EMPTY":
            continue
        moving = (one.animation_data for one in (block, block.data))
        if any(one is not None and (one.action or one.drivers) for one in moving):
            lost.append(
                f"animation of {block.name} is not taken over but for this frame: nothing moves "
                "here"
            )
        matrix = to_stage @ block.matrix_world
        if block.type in _SURFACES:
            yield from _write_surface(context, layer, block, matrix, names, lost)
        elif block.type == "CAMERA":
            yield from _write_camera(context, layer, block, matrix, names, lost)
        elif block.type == "LIGHT":
            yield from _write_light(layer, block, matrix, names, lost)
        else:
            kind = block.type.replace("_", " ").lower()
            lost.append(
                f"{kind} {block.name} is not taken over: nothing in the bundle is made of objects "
                "of this type"
            )


class _Names:
    """Defines prims whose paths exist neither in the layer nor in the stage."""

    def __init__(self, layer, stage):
        self._layer, self._stage = layer, stage

    def define(self, group, kind, name):
        """Define a prim in a group, with the object's name as its display name; return its path.

        Characters that USD does not allow become underscores. A name in use gets a number.
        """
        legal = re.sub(r"\W", "_", name, flags=re.ASCII)
        legal = f"_{legal}" if not legal or legal[0].isdigit() else legal
        path, number = f"{group}/{legal}", 1
        while self._layer.GetPrimAtPath(path) or self._stage.GetPrimAtPath(path):
            number += 1
            path = f"{group}/{legal}_{number}"
        spec = Sdf.CreatePrimInLayer(self._layer, path)
        spec.specifier, spec.typeName = Sdf.SpecifierDef, kind
        spec.SetInfo("displayName", name)
        if group == ANNOTATIONS:
            above = self._layer.GetPrimAtPath(group)
            above.specifier, above.typeName = Sdf.SpecifierDef, "Scope"
        return path


def _write_surface(context, layer, block, matrix, names, lost):
    evaluated = block.evaluated_get(context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    if mesh is None or not mesh.polygons:
        evaluated.to_mesh_clear()
        lost.append(f"{block.name} is not taken over: it has no faces")
        return
    mesh.calc_loop_triangles()
    corners = _read(mesh.loop_triangles, "loops", np.int32, 3)
    vertices = _read(mesh.loop_triangles, "vertices", np.int32, 3)
    points = _read(mesh.vertices, "co", np.float32, 3).astype(np.float64)
    normals = _read(mesh.corner_normals, "vector", np.float32, 3).astype(np.float64)[corners]
    slots = {slot.material.name for slot in block.material_slots if slot.material}
    evaluated.to_mesh_clear()
    rows = np.array(matrix)
    if np.linalg.det(rows[:3, :3]) < 0:  # mirroring turns the faces over
        vertices, normals = vertices[:, ::-1], normals[:, ::-1]
    points = points @ rows[:3, :3].T + rows[:3, 3]
    normals = normals @ np.linalg.inv(rows[:3, :3])
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-12)
    path = names.define(ANNOTATIONS, "Mesh", block.name)
    shape = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32))
    turned = np.ascontiguousarray(normals.reshape(-1, 3), np.float32)
    indices = np.ascontiguousarray(vertices.ravel(), np.int32)
    set_value(layer, path, "points", _Types.Point3fArray, shape)
    set_value(layer, path, "extent", _Types.Float3Array, UsdGeom.PointBased.ComputeExtent(shape))
    counts = Vt.IntArray([3] * len(vertices))
    set_value(layer, path, "faceVertexCounts", _Types.IntArray, counts)
    set_value(layer, path, "faceVertexIndices", _Types.IntArray, Vt.IntArray.FromNumpy(indices))
    set_value(layer, path, "normals", _Types.Normal3fArray, Vt.Vec3fArray.FromNumpy(turned))
    layer.GetAttributeAtPath(f"{path}.normals").SetInfo("interpolation", "faceVarying")
    set_value(layer, path, "subdivisionScheme", _Types.Token, "none", is_uniform=True)
    _write_material(layer, path, block, lost)
    if len(slots) > 1:
        lost.append(f"more than one material of {block.name} is not taken over: the first is")
    yield f"{block.name}: added"


def _write_material(layer, path, block, lost):
    """Give a mesh the plain values of its first material; without a material, write none."""
    materials = [slot.material for slot in block.material_slots if slot.material]
    if not materials:
        return
    values, images = plain_values(materials[0])
    for name in images:
        lost.append(
            f"image of {name} of material {materials[0].name} is not taken over: added meshes have "
            "none"
        )
    tree = materials[0].node_tree
    if tree and not any(node.bl_idname == "ShaderNodeBsdfPrincipled" for node in tree.nodes):
        lost.append(
            f"nodes of material {materials[0].name} are not taken over: a Principled BSDF is"
        )
    over = f"{path}/material"
    for place, kind in ((over, "Material"), (f"{over}/surface", "Shader")):
        spec = Sdf.CreatePrimInLayer(layer, place)
        spec.specifier, spec.typeName = Sdf.SpecifierDef, kind
    shader = f"{over}/surface"
    set_value(layer, shader, "info:id", _Types.Token, "UsdPreviewSurface", is_uniform=True)
    for name, value in values.items():
        is_color = isinstance(value, tuple)
        kind = _Types.Color3f if is_color else _Types.Float
        set_value(layer, shader, f"inputs:{name}", kind, Gf.Vec3f(*value) if is_color else value)
    _declare(layer, shader, "outputs:surface")
    _declare(layer, over, "outputs:surface").connectionPathList.explicitItems = [
        Sdf.Path(f"{shader}.outputs:surface")
    ]
    prim = layer.GetPrimAtPath(path)
    prim.SetInfo("apiSchemas", Sdf.TokenListOp.CreateExplicit(["MaterialBindingAPI"]))
    binding = Sdf.RelationshipSpec(prim, "material:binding", False)
    binding.targetPathList.explicitItems = [Sdf.Path(over)]


def _write_camera(context, layer, block, matrix, names, lost):
    camera = block.data
    if camera.type != "PERSP":
        lost.append(f"camera {block.name} is not taken over: its lens is no perspective")
        return
    render = context.scene.render
    width = render.resolution_x * render.pixel_aspect_x
    height = render.resolution_y * render.pixel_aspect_y
    fit = camera.sensor_fit
    if fit == "VERTICAL":
        vertical = camera.sensor_height
    else:  # AUTO fits the sensor's width to the longer edge of the frame
        is_wide = fit == "HORIZONTAL" or width >= height
        vertical = camera.sensor_width * (height / width if is_wide else 1.0)
    for name, is_set in (
        ("shift", camera.shift_x or camera.shift_y),
        ("depth of field", camera.dof.use_dof),
    ):
        if is_set:
            lost.append(f"{name} of camera {block.name} is not taken over: the viewer has none")
    path = names.define(CAMERAS, "Camera", block.name)
    set_value(layer, path, "focalLength", _Types.Float, camera.lens)
    set_value(layer, path, "verticalAperture", _Types.Float, vertical)
    set_value(layer, path, "horizontalAperture", _Types.Float, vertical * width / height)
    _place(layer, path, matrix)
    yield f"{block.name}: a view"


def _write_light(layer, block, matrix, names, lost):
    light = block.data
    if light.type not in ("SUN", "POINT"):
        kind = light.type.lower()
        lost.append(
            f"{kind} light {block.name} is not taken over: the viewer's lamps are suns and points"
        )
        return
    is_sun = light.type == "SUN"
    path = names.define(LIGHTS, "DistantLight" if is_sun else "SphereLight", block.name)
    set_value(layer, path, "inputs:color", _Types.Color3f, Gf.Vec3f(*color_of_light(light)))
    set_value(layer, path, "inputs:normalize", _Types.Bool, True)
    if exposure := getattr(light, "exposure", 0.0):
        set_value(layer, path, "inputs:exposure", _Types.Float, exposure)
    if not getattr(light, "normalize", True):
        lost.append(
            f"strength by area of light {block.name} is not taken over: turn on its Normalize"
        )
    if is_sun:
        set_value(layer, path, "inputs:angle", _Types.Float, math.degrees(light.angle))
        set_value(layer, path, "inputs:intensity", _Types.Float, light.energy)
    else:
        # At distance d, a point light of P watts in Blender gives P / (4 pi d^2), and a normalized
        # sphere light in USD gives intensity / (4 d^2). Blender and the stage measure d in their
        # own units.
        scale = abs(matrix.to_3x3().determinant()) ** (1 / 3)
        scale /= abs(block.matrix_world.to_3x3().determinant()) ** (1 / 3)
        radius = max(light.shadow_soft_size * scale, 1e-3)
        set_value(layer, path, "inputs:radius", _Types.Float, radius)
        set_value(layer, path, "inputs:intensity", _Types.Float, light.energy / math.pi * scale**2)
    _place(layer, path, matrix)
    yield f"{block.name}: a lamp"


def _place(layer, path, matrix):
    """Write an object's position and rotation; cameras and lights ignore its scale."""
    place = Matrix.LocRotScale(matrix.translation, matrix.to_quaternion(), None)
    rows = [[round(float(v), 6) for v in row] for row in place.transposed()]
    set_value(layer, path, "xformOp:transform", _Types.Matrix4d, Gf.Matrix4d(rows))
    order = Vt.TokenArray(["xformOp:transform"])
    set_value(layer, path, "xformOpOrder", _Types.TokenArray, order, is_uniform=True)


def _declare(layer, path, name):
    return Sdf.AttributeSpec(layer.GetPrimAtPath(path), name, _Types.Token)


def _read(items, name, kind, width):
    values = np.empty(len(items) * width, kind)
    items.foreach_get(name, values)
    return values.reshape(-1, width)
