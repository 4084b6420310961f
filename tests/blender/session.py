"""Run one step of tests/test_blender.py inside Blender's Python: session.py STEP ARGUMENTS.JSON.

The step's findings go to the file that the arguments name as `result`, as JSON: Blender writes
lines of its own to standard output.
"""

import json
import sys
from pathlib import Path

import bpy

# Blender's own pxr: an application has it on its path, the wheel does not
LOCAL = Path(bpy.utils.resource_path("LOCAL"))
sys.path += [str(path) for path in LOCAL.glob("python/lib/python3*/site-packages")]
sys.path.append(str(Path(__file__).parents[2] / "usd_assets" / "blender"))

import stereocell_import  # noqa: E402
from stereocell_import.importing import COLOR, PRIM, VOLUME  # noqa: E402
from stereocell_import.looks import color_of, points_of  # noqa: E402

_FIELDS = ("tiles", "lod", "representation", "transfer_function", "size")


def import_stage(arguments):
    """Import by the operator, as the menu does; return the root object."""
    chosen = {key: arguments[key] for key in _FIELDS if key in arguments}
    assert bpy.ops.import_scene.stereocell(filepath=arguments["stage"], **chosen) == {"FINISHED"}
    return bpy.context.view_layer.objects.active


def describe(root):
    """Return what is in the scene, in units of the stage and by the paths of prims."""
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
    """Return the colour that a mesh is drawn with: along the link, through the channel's group."""
    (surface,) = [n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled"]
    socket = surface.inputs["Base Color"]
    if not socket.links:
        return list(socket.default_value)[:3]
    return list(color_of(socket.links[0].from_node.node_tree))


def step_import(arguments):
    return describe(import_stage(arguments))


def step_refuse(arguments):
    """Return the one line that a user sees."""
    chosen = {key: arguments[key] for key in _FIELDS if key in arguments}
    try:
        bpy.ops.import_scene.stereocell(filepath=arguments["stage"], **chosen)
    except RuntimeError as error:  # how an operator's report reaches a script
        return str(error)
    return ""


def by_prim(path):
    (block,) = [block for block in bpy.data.objects if block.get(PRIM) == path]
    return block


def step_edit(arguments):
    """Change what an artist would, and export it."""
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
        by_prim(path).hide_set(True)  # the key H
    for path in arguments.get("delete", []):
        bpy.data.objects.remove(by_prim(path))
    for path, offset in arguments.get("move", {}).items():
        by_prim(path).location += type(root.location)(offset)
    assert bpy.ops.export_scene.stereocell_edits(filepath=arguments["overlay"]) == {"FINISHED"}
    return Path(arguments["overlay"]).read_text()


def step_render(arguments):
    """Render a picture with Cycles: see test_blender.py for what is in it."""
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
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = arguments.get("pixels", [320, 180])
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = arguments["picture"]
    bpy.ops.render.render(write_still=True)
    return {"engine": scene.render.engine}


def main():
    step, file = sys.argv[1:]
    arguments = json.loads(Path(file).read_text())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    stereocell_import.register()
    result = globals()[f"step_{step}"](arguments)
    stereocell_import.unregister()
    Path(arguments["result"]).write_text(json.dumps(result))


main()
