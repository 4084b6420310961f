"""Light an imported stage with its own lights, and prepare the scene for rendering.

Blender's importer makes the lights and the world. It makes distant lights four times as bright as
USD defines them, so their strength is set here. The camera sees a plain dark backdrop in place of
the dome's image. The cube and the lamp of the startup scene are hidden: they would stand inside the
specimen.
"""

import bpy

from .choice import ROOT

BACKDROP = (0.0033, 0.0040, 0.0060)  # linear RGB; the background of the web viewer
SAMPLES = 64  # samples per pixel of a Cycles render, which is denoised afterwards
_WORLD = "StereoCell studio"
_DOMES = ("DomeLight", "DomeLight_1")  # USD's type names
_STARTUP_LAMP_W = 1000.0


def begin_world(scene):
    """Give the scene an empty world, which the import of a dome fills."""
    scene.world = bpy.data.worlds.new(_WORLD)


def end_world(scene, before):
    """Remove the scene's world, and give the scene its earlier world back."""
    bpy.data.worlds.remove(scene.world)
    scene.world = before


def light_scene(scene, stage, objects, before):
    """Set lights, world, colours and renderer after an import.

    objects  Blender's objects by the path of their prim
    before   the scene's earlier world, which is restored if the stage has no dome light
    """
    _set_strengths(stage, objects)
    if any(prim.GetTypeName() in _DOMES for prim in stage.Traverse()):
        _separate_backdrop(scene.world)
    else:
        end_world(scene, before)
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    _hide_startup_objects(scene)
    if any(block.type == "VOLUME" for block in objects.values()):
        _choose_cycles(scene)
    _look_through_camera(scene, objects)


def _set_strengths(stage, objects):
    """Set each sun to the irradiance that USD defines: the intensity of a normalized light."""
    for path, block in objects.items():
        prim = stage.GetPrimAtPath(path)
        if block.type != "LIGHT" or block.data.type != "SUN" or not prim:
            continue
        if not prim.GetAttribute("inputs:normalize").Get():
            continue
        exposure = prim.GetAttribute("inputs:exposure").Get() or 0.0
        if hasattr(block.data, "exposure"):
            block.data.exposure = 0.0
        block.data.energy = prim.GetAttribute("inputs:intensity").Get() * 2**exposure


def light_values(block):
    """Return a light's strength and linear colour; an export compares them with the import's."""
    exposure = getattr(block.data, "exposure", 0.0)
    return [block.data.energy * 2**exposure, *color_of_light(block.data)]


def color_of_light(light):
    """Return a light's linear colour, multiplied by the colour of its temperature."""
    color = list(light.color)
    if getattr(light, "use_temperature", False):
        color = [a * b for a, b in zip(color, light.temperature_color, strict=True)]
    return color


def intensity_of(prim, energy, before):
    """Return the stage's intensity for a light that now has the strength `energy` in Blender.

    `before` is its strength in Blender at the import.
    """
    known = prim.GetAttribute("inputs:intensity").Get()
    return known * energy / before if before > 0 else energy


def _separate_backdrop(world):
    """Show the camera a plain backdrop in place of the dome, which still lights the scene."""
    tree = world.node_tree
    output = next((n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputWorld"), None)
    if output is None or not output.inputs["Surface"].links:
        return
    dome = output.inputs["Surface"].links[0].from_socket
    path, backdrop, mix = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("LightPath", "Background", "MixShader")
    )
    backdrop.label = "backdrop"
    backdrop.inputs["Color"].default_value = (*BACKDROP, 1.0)
    for node, x, y in ((path, 0, 300), (backdrop, 0, -200), (mix, 250, 0), (output, 450, 0)):
        node.location = (dome.node.location.x + x, dome.node.location.y + y)
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(dome, mix.inputs[1])
    tree.links.new(backdrop.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])


def _hide_startup_objects(scene):
    """Hide the cube and the lamp of the startup scene, if nobody has changed them."""
    for block in scene.objects:
        if _is_startup_cube(block) or _is_startup_lamp(block):
            block.hide_render = True
            block.hide_set(True)


def _is_startup_cube(block):
    if block.name != "Cube" or block.type != "MESH" or len(block.data.vertices) != 8:
        return False
    is_unmoved = block.matrix_world.is_identity and not block.modifiers
    return is_unmoved and all(abs(part) == 1 for v in block.data.vertices for part in v.co)


def _is_startup_lamp(block):
    is_lamp = block.name == "Light" and block.type == "LIGHT" and block.data.type == "POINT"
    return is_lamp and block.data.energy == _STARTUP_LAMP_W and block.parent is None


def _choose_cycles(scene):
    """Choose Cycles, which draws dense volumes, with settings that take minutes, not hours.

    `volume_biased` of Blender 5 stays off. With it, a render starts at once instead of after 20 s,
    but has gaps along the cuts between tiles, where the volumes of several channels overlap.
    """
    scene.render.engine = "CYCLES"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = True
    if hasattr(scene.cycles, "volume_biased"):
        scene.cycles.volume_biased = False


def _look_through_camera(scene, objects):
    """Show the camera's view in all 3D views, with the camera's clip distances."""
    camera = objects.get(f"{ROOT}/Cameras/mono")
    if camera is None or scene.camera != camera:
        return
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type != "VIEW_3D":
                continue
            space = area.spaces.active
            space.clip_start, space.clip_end = camera.data.clip_start, camera.data.clip_end
            if space.region_3d is not None:
                space.region_3d.view_perspective = "CAMERA"
            is_meshes = scene.render.engine != "CYCLES"
            space.shading.type = "RENDERED" if is_meshes else "SOLID"
