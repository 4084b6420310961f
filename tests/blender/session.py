"""Run steps of this folder's tests inside Blender's Python, each in its own process.

Each line of standard input is a JSON object: `step` is the name of a step, and `arguments` is the
path of a JSON file with its arguments. The step's result is written as JSON to the file `result` of
the arguments. The text that the step prints goes to the same name with `.txt` appended. One line of
standard output has the exit code.

Blender is loaded once for all steps, because loading takes longer than most steps do.
"""

import json
import math
import os
import sys
import traceback
from pathlib import Path
from types import SimpleNamespace

# Blender prints its own lines to standard output, so the answers get a separate file descriptor.
ANSWERS = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)

import bpy  # noqa: E402

# Blender the application has its own pxr on the path. The wheel bpy has not, so it is added here.
LOCAL = Path(bpy.utils.resource_path("LOCAL"))
sys.path += [str(path) for path in LOCAL.glob("python/lib/python3*/site-packages")]
sys.path.append(str(Path(__file__).parents[2] / "usd_assets" / "blender"))

import bmesh  # noqa: E402  (bpy brings it)
import mathutils  # noqa: E402  (bpy brings it)
import stereocell_import  # noqa: E402
from mathutils import Matrix  # noqa: E402
from pxr import UsdUtils  # noqa: E402
from stereocell_import.importing import COLOR, PRIM, VOLUME  # noqa: E402
from stereocell_import.looks import color_of, points_of  # noqa: E402

_FIELDS = (
    "tiles",
    "channels",
    "lod",
    "representation",
    "transfer_function",
    "size",
    "is_lit",
    "is_stereo",
)


def import_stage(arguments):
    """Import with the operator, as the menu does; return the root object."""
    chosen = {key: arguments[key] for key in _FIELDS if key in arguments}
    assert bpy.ops.import_scene.stereocell(filepath=arguments["stage"], **chosen) == {"FINISHED"}
    return bpy.context.view_layer.objects.active


def describe(root):
    """Return a description of the scene, in units of the stage and by the paths of prims."""
    bpy.context.view_layer.update()
    found = {"meshes": {}, "volumes": {}, "cameras": {}, "colors": {}, "functions": {}}
    to_stage = root.matrix_world.inverted()
    for block in bpy.data.objects:
        if block.type == "MESH":
            corners = [to_stage @ block.matrix_world @ v.co for v in block.data.vertices]
            found["meshes"][block[PRIM]] = {
                "low": [min(c[k] for c in corners) for k in range(3)],
                "high": [max(c[k] for c in corners) for k in range(3)],
                "world": list(block.dimensions),
                "faces": len(block.data.polygons),
                "name": block.name,
                "color": surface_color(block.data.materials[0]),
            }
        elif block.type == "VOLUME":
            block.data.grids.load()
            corners = [
                to_stage @ block.matrix_world @ type(block.location)(c) for c in block.bound_box
            ]
            found["volumes"][block[PRIM]] = {
                "grids": [grid.name for grid in block.data.grids],
                "error": block.data.grids.error_message,
                "low": [min(c[k] for c in corners) for k in range(3)],
                "high": [max(c[k] for c in corners) for k in range(3)],
                "material": block.data.materials[0].name,
            }
        elif block.type == "CAMERA":
            stereo = block.data.stereo
            found["cameras"][block.name] = {
                "at": list(block.matrix_world.translation),
                "lens": block.data.lens,
                "sensor": block.data.sensor_width,
                "shift": block.data.shift_x,
                "clip": [block.data.clip_start, block.data.clip_end],
                "eyes": stereo.interocular_distance,
                "convergence": stereo.convergence_distance,
            }
    for key in list(root.keys()):
        if key.startswith(COLOR):
            found["colors"][key.removeprefix(COLOR)] = list(color_of(root[key]))
        elif key.startswith(VOLUME):
            found["functions"][key.removeprefix(VOLUME)] = points_of(root[key])
    found["root_scale"] = list(root.matrix_world.to_scale())
    found["unit"] = bpy.context.scene.unit_settings.scale_length
    return found


def surface_color(material):
    """Return the colour in which a mesh is drawn; follow the link to the channel's group."""
    (surface,) = [n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled"]
    socket = surface.inputs["Base Color"]
    if not socket.links:
        return list(socket.default_value)[:3]
    return list(color_of(socket.links[0].from_node.node_tree))


def step_import(arguments):
    return describe(import_stage(arguments))


def step_find_functions(arguments):
    """Return the names that the file dialog offers for the transfer function."""
    dialog = SimpleNamespace(filepath=arguments["stage"])
    return stereocell_import._find_functions(dialog, bpy.context, "")


def step_objects(arguments):
    """Return the attributes of a label map's meshes by name, and the faces of each material."""
    import_stage(arguments)
    found = {}
    for block in bpy.data.objects:
        if block.type != "MESH":
            continue
        faces = len(block.data.polygons)
        columns = {}
        for attribute in block.data.attributes:
            if attribute.domain == "FACE" and attribute.data_type in ("FLOAT", "INT"):
                values = [0.0] * faces
                attribute.data.foreach_get("value", values)
                columns[attribute.name] = values
        slots = [slot.material for slot in block.material_slots]
        found[block[PRIM]] = {
            "columns": columns,
            "classes": [slots[p.material_index].name for p in block.data.polygons],
            "colors": {material.name: surface_color(material) for material in slots},
        }
    return found


def step_edit_objects(arguments):
    """Edit a label map's objects with the panel's operators; export, and return what was seen."""
    root = import_stage(arguments)
    (block,) = [one for one in bpy.data.objects if one.get("stereocell_labels")]
    bpy.context.view_layer.objects.active = root
    found = {"labels": json.loads(block["stereocell_labels"])}

    def faces():
        evaluated = block.evaluated_get(bpy.context.evaluated_depsgraph_get())
        return len(evaluated.data.polygons)

    def call(operator, **given):
        assert getattr(bpy.ops.stereocell, operator)(**given) == {"FINISHED"}

    def ids(chosen):
        values = block.data.attributes["objectId"].data
        return sorted({values[face.index].value for face in block.data.polygons if chosen(face)})

    call("color_by", column="CD3")
    material = block.material_slots[0].material
    (surface,) = [n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled"]
    found["fed by"] = surface.inputs["Base Color"].links[0].from_node.bl_idname
    call("select_class", category=arguments["class"])
    found["selected"] = ids(lambda face: face.select)
    call("color_selected", color=(0.0, 0.25, 1.0))
    found["color"] = next(
        list(block.data.attributes["displayColor"].data[face.loop_start].color)[:3]
        for face in block.data.polygons
        if face.select
    )
    before = faces()
    call("hide_by_value", column="CD3", low=arguments["low"])
    found["faces"] = [before, faces(), len(block.data.polygons)]
    call("rename_class", category=arguments["class"], name="it's mine")
    if arguments.get("shown again"):
        call("show_all")
        found["faces"].append(faces())
    if arguments.get("picture"):
        scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        scene.cycles.samples, scene.cycles.device = 8, "CPU"
        scene.render.use_multiview = False
        scene.render.resolution_x, scene.render.resolution_y = 480, 320
        sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
        sun.rotation_euler = (0.9, 0.2, 0.6)
        scene.collection.objects.link(sun)
        scene.render.filepath = arguments["picture"]
        bpy.ops.render.render(write_still=True)
    assert bpy.ops.export_scene.stereocell_edits(filepath=arguments["overlay"]) == {"FINISHED"}
    return found


def step_measured(arguments):
    """Return the values that Blender's OpenVDB reads at points of the grid `measured` of a .vdb."""
    bpy.ops.object.volume_import(filepath=arguments["vdb"])
    volume = bpy.context.object
    mesh = bpy.data.meshes.new("points")
    mesh.from_pydata(arguments["points"], [], [])
    points = bpy.data.objects.new("points", mesh)
    bpy.context.collection.objects.link(points)
    tree = bpy.data.node_groups.new("sample", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    names = ("ObjectInfo", "GetNamedGrid", "SampleGrid", "InputPosition", "StoreNamedAttribute")
    read, named, sample, position, store = (tree.nodes.new(f"GeometryNode{name}") for name in names)
    given, made = (tree.nodes.new(f"NodeGroup{name}") for name in ("Input", "Output"))
    read.inputs["Object"].default_value = volume
    named.inputs["Name"].default_value = "measured"
    sample.inputs["Interpolation"].default_value = "Nearest Neighbor"
    store.inputs["Name"].default_value = "value"
    for source, target in (
        (read.outputs["Geometry"], named.inputs["Volume"]),
        (named.outputs["Grid"], sample.inputs["Grid"]),
        (position.outputs[0], sample.inputs["Position"]),
        (given.outputs[0], store.inputs["Geometry"]),
        (sample.outputs["Value"], store.inputs["Value"]),
        (store.outputs[0], made.inputs[0]),
    ):
        tree.links.new(source, target)
    points.modifiers.new("sample", "NODES").node_group = tree
    found = points.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return {"values": [one.value for one in found.data.attributes["value"].data]}


def step_refuse(arguments):
    """Return the error message of an import; empty if the import succeeds."""
    chosen = {key: arguments[key] for key in _FIELDS if key in arguments}
    try:
        bpy.ops.import_scene.stereocell(filepath=arguments["stage"], **chosen)
    except RuntimeError as error:  # an operator's error report becomes this exception in a script
        return str(error)
    return ""


def by_prim(path):
    (block,) = [block for block in bpy.data.objects if block.get(PRIM) == path]
    return block


def step_edit(arguments):
    """Make the edits that the arguments name, as an artist would, and export them."""
    root = import_stage(arguments)
    if "color" in arguments:
        channel, color = arguments["color"]
        for node in root[COLOR + channel].nodes:
            if node.bl_idname == "ShaderNodeRGB":
                node.outputs[0].default_value = (*color, 1.0)
    if "points" in arguments:
        channel, points = arguments["points"]
        (ramp,) = [n for n in root[VOLUME + channel].node_tree.nodes if n.type == "VALTORGB"]
        elements = ramp.color_ramp.elements
        while len(elements) > 1:
            elements.remove(elements[-1])
        elements[0].position = points[0][0]
        for position, _ in points[1:]:
            elements.new(position)
        for element, (_, opacity) in zip(elements, points, strict=True):
            element.color = (1, 1, 1, opacity)
    for path in arguments.get("hide", []):
        by_prim(path).hide_set(True)  # the same as the key H
    for path in arguments.get("delete", []):
        bpy.data.objects.remove(by_prim(path))
    for path, offset in arguments.get("move", {}).items():
        by_prim(path).location += type(root.location)(offset)
    for path, (axis, above, offset) in arguments.get("pull", {}).items():
        for vertex in by_prim(path).data.vertices:
            if vertex.co[axis] > above:
                vertex.co[axis] += offset
    for name in arguments.get("odd", []):
        _ODD[name](root)
    assert bpy.ops.export_scene.stereocell_edits(filepath=arguments["overlay"]) == {"FINISHED"}
    return {}


def a_mesh(_root):
    return next(block for block in bpy.data.objects if block.type == "MESH")


def drop_a_face(root):
    mesh = a_mesh(root).data
    faces = [list(face.vertices) for face in mesh.polygons][1:]
    points = [vertex.co.copy() for vertex in mesh.vertices]
    mesh.clear_geometry()
    mesh.from_pydata(points, [], faces)


def add_a_vertex(root):
    a_mesh(root).data.vertices.add(1)


def rename(root):
    a_mesh(root).name = "it's mine"


def copy(root):
    block = a_mesh(root)
    bpy.context.scene.collection.objects.link(block.copy())


def add_new(_root):
    block = bpy.data.objects.new("arrow", bpy.data.meshes.new("arrow"))
    bpy.context.scene.collection.objects.link(block)


def add_a_probe(_root):
    bpy.ops.object.lightprobe_add(type="SPHERE")


def add_a_spot(_root):
    bpy.ops.object.light_add(type="SPOT")


def smooth_by_modifier(root):
    a_mesh(root).modifiers.new("Smooth", "SMOOTH")


def rewire_a_material(root):
    material = a_mesh(root).material_slots[0].material
    (shader,) = [n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled"]
    shader.inputs["Roughness"].default_value = 0.9


def replace_a_material(root):
    a_mesh(root).material_slots[0].material = bpy.data.materials.new("gold")


def color_a_ramp(root):
    material = next(root[key] for key in root.keys() if key.startswith(VOLUME))  # noqa: SIM118
    (ramp,) = [n for n in material.node_tree.nodes if n.type == "VALTORGB"]
    ramp.color_ramp.elements[0].color = (1, 0, 0, ramp.color_ramp.elements[0].color[3])


def move_a_camera(_root):
    by_prim("/Specimen/Cameras/mono").location.x += 5


def change_the_world(_root):
    tree = bpy.context.scene.world.node_tree
    node = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground" and not n.label)
    node.inputs["Strength"].default_value += 1


def take_out(root):
    a_mesh(root).parent = None


def add_shape_keys(root):
    a_mesh(root).shape_key_add(name="Basis")


def animate(root):
    a_mesh(root).keyframe_insert("location")


def paint_other_uvs(root):
    a_mesh(root).data.uv_layers[0].uv[0].vector = (0.5, 0.25)


def work_in_edit_mode(root):
    """Move the points of a mesh in edit mode, and stay in this mode for the export."""
    block = a_mesh(root)
    bpy.context.view_layer.objects.active = block
    bpy.ops.object.mode_set(mode="EDIT")
    form = bmesh.from_edit_mesh(block.data)
    for vertex in form.verts:
        vertex.co.z += 0.5
    bmesh.update_edit_mesh(block.data)


def an_arrow(name):
    """Add an object with one triangle; return it."""
    arrow = bpy.data.meshes.new(name)
    arrow.from_pydata([(0, 0, 0), (2, 4, 0), (-2, 4, 0)], [], [(0, 1, 2)])
    block = bpy.data.objects.new(name, arrow)
    bpy.context.scene.collection.objects.link(block)
    return block


def instance_a_collection(_root):
    pins = bpy.data.collections.new("pins")
    bpy.ops.object.empty_add()
    empty = bpy.context.active_object
    empty.name, empty.instance_type, empty.instance_collection = "pins", "COLLECTION", pins


def shift_a_camera(_root):
    bpy.ops.object.camera_add()
    camera = bpy.context.active_object
    camera.name, camera.data.shift_y = "Close", 0.25


def animate_an_arrow(_root):
    an_arrow("arrow").keyframe_insert("location")


def paint_without_a_principled_shader(_root):
    material = bpy.data.materials.new("neon")
    material.use_nodes = True
    material.node_tree.nodes.clear()
    material.node_tree.nodes.new("ShaderNodeEmission")
    an_arrow("arrow").data.materials.append(material)


def light_by_area(_root):
    bpy.ops.object.light_add(type="POINT")
    lamp = bpy.context.active_object
    lamp.name, lamp.data.normalize = "Bulb", False


def shine(root):
    """Add a sun with an exposure and a temperature, and an arrow that is brighter than white."""
    bpy.ops.object.light_add(type="SUN")
    sun = bpy.context.active_object
    sun.name, sun.data.energy, sun.data.exposure = "Evening", 2.0, 3.0
    sun.data.use_temperature, sun.data.temperature = True, 2500.0
    material = gold()
    (shader,) = [n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled"]
    shader.inputs["Base Color"].default_value = (2.0, 1.0, 0.0, 1.0)
    shader.inputs["Emission Color"].default_value = (1.0, 0.25, 0.0, 1.0)
    shader.inputs["Emission Strength"].default_value = 8.0
    block = an_arrow("arrow")
    block.data.materials.append(material)
    block.matrix_world = root.matrix_world


def gold():
    """Return a translucent material with plain values."""
    material = bpy.data.materials.new("gold")
    material.use_nodes = True
    (shader,) = [n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled"]
    shader.inputs["Base Color"].default_value = (1.0, 0.5, 0.0, 1.0)
    shader.inputs["Metallic"].default_value = 1.0
    shader.inputs["Roughness"].default_value = 0.25
    shader.inputs["Alpha"].default_value = 0.5
    return material


def decorate(root):
    """Add an arrow, a mirrored box, a text, a wire, a camera and lamps; edit lamps and opacity."""
    at_stage = root.matrix_world

    def add(block, place):
        block.matrix_world = at_stage @ place
        return block

    arrow = bpy.data.meshes.new("arrow")
    arrow.from_pydata([(0, 0, 0), (2, 4, 0), (-2, 4, 0)], [], [(0, 1, 2)])
    block = bpy.data.objects.new("arrow: here", arrow)
    bpy.context.scene.collection.objects.link(block)
    block.data.materials.append(gold())
    add(block, Matrix.Translation((10, -5, 20)))
    bpy.ops.mesh.primitive_cube_add(size=2)
    box = bpy.context.active_object
    box.name = "box"
    add(box, Matrix.Translation((40, -5, 4)) @ Matrix.Diagonal((-3, 2, 1, 1)))
    bpy.ops.object.text_add()
    text = bpy.context.active_object
    text.name, text.data.body = "label", "CD8"
    add(text, Matrix.Translation((0, 5, 10)) @ Matrix.Scale(4, 4))
    bpy.ops.curve.primitive_bezier_circle_add(radius=1)
    wire = bpy.context.active_object
    wire.name, wire.data.bevel_depth = "wire", 0.1
    add(wire, Matrix.Translation((10, -5, 4)) @ Matrix.Scale(8, 4))
    bpy.ops.object.camera_add()
    camera = bpy.context.active_object
    camera.name, camera.data.lens = "Close", 50
    camera.data.sensor_fit, camera.data.sensor_height = "VERTICAL", 20
    add(camera, Matrix.Translation((10, -5, 60)))
    bpy.ops.object.light_add(type="SUN")
    sun = bpy.context.active_object
    sun.name, sun.data.energy, sun.data.color = "Evening", 2.0, (1, 0.5, 0.25)
    add(sun, Matrix.Rotation(math.pi / 2, 4, "Y"))  # the sun shines along -x
    bpy.ops.object.light_add(type="POINT")
    lamp = bpy.context.active_object
    lamp.name, lamp.data.energy = "Bulb", 2e4 * math.pi**2 * at_stage.to_scale().x ** 2
    add(lamp, Matrix.Translation((20, 95, 4)))
    by_prim("/Specimen/Lights/key").data.energy *= 2
    by_prim("/Specimen/Lights/fill").hide_render = True
    for key in list(root.keys()):
        if key.startswith(COLOR):
            (value,) = [n for n in root[key].nodes if n.bl_idname == "ShaderNodeValue"]
            value.outputs[0].default_value = 0.4
            break


_ODD = {
    one.__name__: one
    for one in (drop_a_face, add_a_vertex, rename, copy, add_new, add_a_probe, add_a_spot,
                smooth_by_modifier, rewire_a_material, replace_a_material, color_a_ramp,
                move_a_camera, change_the_world, take_out, add_shape_keys, animate,
                paint_other_uvs, work_in_edit_mode, decorate, instance_a_collection, shift_a_camera,
                animate_an_arrow, paint_without_a_principled_shader, light_by_area, shine)
}  # fmt: skip


def step_render(arguments):
    """Render the stage with Cycles, with the colours and hidden objects of the arguments."""
    root = import_stage(arguments)
    bpy.context.view_layer.update()
    scene = bpy.context.scene
    for channel, color in arguments.get("colors", {}).items():
        for node in root[COLOR + channel].nodes:
            if node.bl_idname == "ShaderNodeRGB":
                node.outputs[0].default_value = (*color, 1.0)
    for path in arguments.get("hide", []):
        by_prim(path).hide_render = True
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy = 3.0
    sun.rotation_euler = (0.9, 0.2, 0.6)
    scene.collection.objects.link(sun)
    scene.world = bpy.data.worlds.new("world")
    scene.world.color = (0.02, 0.02, 0.02)
    scene.render.use_multiview = False
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = arguments.get("samples", 16)
    scene.cycles.use_denoising = False
    scene.cycles.volume_biased = True  # without it, the first ray takes 20 s at any image size
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = arguments.get("pixels", [320, 180])
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = arguments["picture"]
    bpy.ops.render.render(write_still=True)
    return {"engine": scene.render.engine}


def step_plain_import(arguments):
    """Import a stage with Blender's own importer; return its colours, lights and dome images."""
    bpy.context.scene.world = bpy.data.worlds.new("World")
    assert bpy.ops.wm.usd_import(filepath=arguments["stage"]) == {"FINISHED"}
    blocks = [block for block in bpy.data.objects if block.type == "MESH"]
    world = bpy.context.scene.world.node_tree
    images = [node.image for node in world.nodes if node.bl_idname == "ShaderNodeTexEnvironment"]
    return {
        "colors": {block.name: surface_color(block.data.materials[0]) for block in blocks},
        "lights": {light.name: light.type for light in bpy.data.lights},
        "sky": [bpy.path.abspath(image.filepath) for image in images],
    }


def step_usdchecker(arguments):
    """Return the errors, warnings and failed checks of `usdchecker` for files, in all variants."""
    found = {}
    for name in arguments["files"]:
        checker = UsdUtils.ComplianceChecker(
            arkit=False,
            skipARKitRootLayerCheck=False,
            rootPackageOnly=False,
            skipVariants=False,
            verbose=False,
        )
        checker.CheckCompliance(str(Path(arguments["stage_dir"]) / name))
        found[name] = [
            *checker.GetErrors(),
            *checker.GetWarnings(),
            *checker.GetFailedChecks(),
        ]
    return found


def faces_at_edges(data):
    """Return the number of edges of a mesh by their number of faces, and the mesh's volume."""
    shape = bmesh.new()
    shape.from_mesh(data)
    counts = {}
    for edge in shape.edges:
        count = str(len(edge.link_faces))
        counts[count] = counts.get(count, 0) + 1
    volume = shape.calc_volume()
    shape.free()
    return {"edges": counts, "volume": volume}


def step_carve(arguments):
    """Import a tile with Blender's own importer; cut a box out of each surface, then smooth it.

    Returns the edges and the volume before, after the cut and after smoothing, and the UVs' names.
    """
    assert bpy.ops.wm.usd_import(filepath=arguments["tile"]) == {"FINISHED"}
    found = {}
    for block in [block for block in bpy.data.objects if block.type == "MESH"]:
        before = faces_at_edges(block.data)
        corners = [block.matrix_world @ mathutils.Vector(corner) for corner in block.bound_box]
        bpy.ops.mesh.primitive_cube_add(size=block.dimensions.x, location=corners[6])
        box = bpy.context.object
        cut = block.modifiers.new("cut", "BOOLEAN")
        cut.operation, cut.object, cut.solver = "DIFFERENCE", box, "EXACT"
        bpy.context.view_layer.objects.active = block
        assert bpy.ops.object.modifier_apply(modifier="cut") == {"FINISHED"}
        after = faces_at_edges(block.data)
        smooth = block.modifiers.new("smooth", "SMOOTH")
        smooth.iterations = 5
        assert bpy.ops.object.modifier_apply(modifier="smooth") == {"FINISHED"}
        uvs = [layer.name for layer in block.data.uv_layers]
        smoothed = faces_at_edges(block.data)
        found[block.name] = {"before": before, "cut": after, "smoothed": smoothed, "uvs": uvs}
        bpy.data.objects.remove(box)
    return found


def step_lighting(arguments):
    """Import into the startup scene; return the lights and settings that affect a render."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    world = scene.world.name
    import_stage(arguments)
    suns = [block for block in bpy.data.objects if block.type == "LIGHT"]
    nodes = scene.world.node_tree.nodes
    backdrop = [node for node in nodes if node.label == "backdrop"]
    return {
        "suns": {b.data.name: b.data.energy for b in suns if b.data.type == "SUN"},
        "has_own_world": scene.world.name == world,
        "worlds": len(bpy.data.worlds),
        "images": [n.image.name for n in nodes if n.bl_idname == "ShaderNodeTexEnvironment"],
        "backdrop": [list(node.inputs["Color"].default_value)[:3] for node in backdrop],
        "transform": scene.view_settings.view_transform,
        "engine": scene.render.engine,
        "hidden": sorted(block.name for block in scene.objects if block.hide_render),
        "eyes": scene.render.use_multiview,
        "camera": scene.camera.name,
    }


def step_gltf(arguments):
    """Open a glTF file with Blender's own importer; return parents, colours and bounds.

    The bounds are in metres, with z up.
    """
    assert bpy.ops.import_scene.gltf(filepath=arguments["file"]) == {"FINISHED"}
    bpy.context.view_layer.update()
    meshes = [block for block in bpy.data.objects if block.type == "MESH"]
    places = [block.matrix_world @ v.co for block in meshes for v in block.data.vertices]
    materials = [slot.material for block in meshes for slot in block.material_slots]
    shaders = {one.name: one.node_tree.nodes["Principled BSDF"] for one in materials}
    return {
        "parents": {block.name: block.parent.name for block in meshes},
        "colors": {name: list(n.inputs["Base Color"].default_value) for name, n in shaders.items()},
        "bounds": [[end(p[k] for p in places) for k in range(3)] for end in (min, max)],
    }


def run(step, arguments):
    """Run a step in a Blender with an empty scene and factory settings."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    stereocell_import.register()
    result = globals()[f"step_{step}"](arguments)
    stereocell_import.unregister()
    Path(arguments["result"]).write_text(json.dumps(result))


def run_forked(step, arguments):
    """Run a step in a fork of this process, which ends with the step; return its exit code."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    code = 1
    try:
        output = os.open(arguments["result"] + ".txt", os.O_WRONLY | os.O_CREAT)
        os.dup2(output, 1)
        os.dup2(output, 2)
        run(step, arguments)
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def main():
    for line in sys.stdin:
        asked = json.loads(line)
        code = run_forked(asked["step"], json.loads(Path(asked["arguments"]).read_text("utf-8")))
        print(code, file=ANSWERS, flush=True)


main()
