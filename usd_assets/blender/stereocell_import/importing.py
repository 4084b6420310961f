"""Import a stage through Blender's own importer, and add the parts that it leaves out.

Custom properties record the state at the import, so that the export can find the edits. The root
object has `stereocell` (JSON), and each channel's colour group and volume material. Every object
has the path of its prim.
"""

import json
import tempfile
from pathlib import Path

import bpy
from pxr import Usd, UsdGeom

from .cameras import pair_cameras
from .choice import CHANNELS, DISPLAY_SCALE, METERS_PER_UNIT, ROOT, TILES, open_stage, write_choice
from .lighting import begin_world, end_world, light_scene, light_values
from .looks import (
    color_surface,
    fit_ramp,
    glow_of,
    make_color_group,
    make_volume_material,
    set_surface_color,
)
from .objects import keep_labels, read_columns
from .problem import StageProblem
from .snapshot import digest_nodes, take_materials, take_snapshot

MICROMETRES, TRUE, DISPLAY = "MICROMETRES", "TRUE", "DISPLAY"  # choices of the import's size
STATE = "stereocell"
PRIM = "stereocell_prim"
COLOR = "stereocell_color_"
VOLUME = "stereocell_volume_"
PAINTED = "stereocell:paintedBy"  # attribute of a channel: the channel that colours its surfaces
COLUMNS = "stereocell:columns"  # attribute of a label map's channel: the columns of its table


class _Hook(bpy.types.USDHook):
    """Passes `finish` the composed stage and the objects that Blender made of its prims."""

    bl_idname = "stereocell_import_hook"
    bl_label = "StereoCell"

    finish = None

    @staticmethod
    def on_import(import_context):
        _Hook.finish(import_context.get_stage(), import_context.get_prim_map())
        return True


def import_stage(context, path, choice, size=MICROMETRES, is_lit=True, is_stereo=False):
    """Import the chosen parts of a stage; return the object of /Specimen. Raises StageProblem.

    size       MICROMETRES: one unit is 1 um; TRUE: 1 m; DISPLAY: 1 m, with an enlarged specimen
    is_lit     whether to add the stage's lights and backdrop, and to set up rendering
    is_stereo  whether images are rendered for both eyes
    """
    stage = open_stage(path)
    scale = _scale_of(stage, size)
    made = {}
    world = context.scene.world
    if is_lit:
        begin_world(context.scene)

    def keep(composed, prim_map):
        made["state"] = _finish(context, composed, prim_map, scale, is_stereo)
        if is_lit:
            objects, state = _objects_of(prim_map), made["state"][1]
            light_scene(context.scene, composed, objects, world)
            state["lights"] = {
                path: light_values(block)
                for path, block in objects.items()
                if block.type == "LIGHT"
            }
            if context.scene.world != world:
                state["world"] = digest_nodes(context.scene.world.node_tree)

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "choice.usda"
        staged = write_choice(stage, choice, file)
        _Hook.finish = keep
        bpy.utils.register_class(_Hook)
        try:
            bpy.ops.wm.usd_import(
                filepath=str(file),
                apply_unit_conversion_scale=False,
                merge_parent_xform=False,
                import_lights=is_lit,
                create_world_material=is_lit,
                mtl_name_collision_mode="MAKE_UNIQUE",
                set_frame_range=False,
            )
        except RuntimeError as error:
            raise StageProblem(f"{path}: {' '.join(str(error).split())}") from error
        finally:
            bpy.utils.unregister_class(_Hook)
            _Hook.finish = None
            if is_lit and "state" not in made:
                end_world(context.scene, world)
    if "state" not in made:
        raise StageProblem(f"{path}: Blender imported no objects from it")
    root, state = made["state"]
    state["lods"] = {tile: found.get("lod", "") for tile, found in state["selected"].items()}
    state["chosen"] = {
        tile: {
            name: variant for name, variant in found.items() if staged[tile].get(name) != variant
        }
        for tile, found in state.pop("selected").items()
    }
    state["stage"] = str(Path(stage.GetRootLayer().realPath))
    root[STATE] = json.dumps(state)
    units = context.scene.unit_settings
    units.system = "METRIC"
    units.scale_length = METERS_PER_UNIT if size == MICROMETRES else 1.0
    units.length_unit = "ADAPTIVE"
    return root


def describe_size(stage):
    """Return a stage's size in words, such as "1 x 2 x 3 mm", from its tiles' bounding boxes.

    The tiles need not be loaded.
    """
    purposes = [UsdGeom.Tokens.default_, UsdGeom.Tokens.render]
    boxes = UsdGeom.BBoxCache(Usd.TimeCode.Default(), purposes, True)
    edges = boxes.ComputeWorldBound(stage.GetPrimAtPath(TILES)).ComputeAlignedRange().GetSize()
    longest = max(edges)
    unit, um = ("um", 1) if longest < 1e3 else ("mm", 1e3) if longest < 1e6 else ("m", 1e6)
    return f"{' x '.join(f'{edge / um:.3g}' for edge in edges)} {unit}"


def _scale_of(stage, size):
    """Return the number of Blender units in one unit of the stage.

    Raises StageProblem if the stage states no display scale and `size` is DISPLAY.
    """
    if size == MICROMETRES:
        return 1.0
    if size == TRUE:
        return METERS_PER_UNIT
    enlarged = stage.GetPrimAtPath(ROOT).GetAttribute(DISPLAY_SCALE).Get()
    if enlarged is None:
        raise StageProblem(
            f"{ROOT}.{DISPLAY_SCALE}: no value, expected a number: run `stereocell stage OUT`"
        )
    return METERS_PER_UNIT * enlarged


def _finish(context, stage, prim_map, scale, is_stereo):
    """Build the channels' materials and the cameras.

    Return the root object and the state that an export compares the scene with.
    """
    objects = _objects_of(prim_map)
    for path, block in objects.items():
        block[PRIM] = path
    materials = [
        (str(path), block)
        for path, made in prim_map.items()
        for block in made
        if isinstance(block, bpy.types.Material)
    ]
    if ROOT not in objects:
        raise StageProblem(f"Blender made no object of {ROOT}")
    root = objects[ROOT]
    root.scale *= scale  # Blender's importer takes no scale below 1e-4
    channels = {}
    for prim in stage.GetPrimAtPath(CHANNELS).GetChildren():
        look = _read_look(prim) | {"objects": read_columns(prim)}
        channels[prim.GetName()] = look
        shown = prim.GetDisplayName() or prim.GetName()
        group = make_color_group(shown, look["color"], look["opacity"])
        root[COLOR + prim.GetName()] = group
        _color_surfaces(stage, prim.GetName(), look, group, materials)
        _shade_volumes(stage, root, prim.GetName(), look, group, objects)
        _name_blocks(prim.GetName(), shown, [*objects.items(), *materials])
    keep_labels(stage, {name for name, one in channels.items() if one["objects"]}, objects)
    context.view_layer.update()
    pair_cameras(context.scene, stage, objects, scale, is_stereo)
    leaves = [p for p, o in objects.items() if o.type in ("MESH", "VOLUME")]
    selected = {
        prim.GetName(): dict(prim.GetVariantSets().GetAllVariantSelections())
        for prim in stage.GetPrimAtPath(TILES).GetChildren()
    }
    own = set(objects.values())
    return root, {
        "channels": channels,
        "leaves": leaves,
        "selected": selected,
        "matrices": {p: matrix_of(p, objects) for p in objects if p != ROOT},
        "snapshots": {p: take_snapshot(block) for p, block in objects.items()},
        "materials": take_materials(objects[path] for path in leaves),
        "lights": {},
        "world": "",
        "others": [block.name for block in context.scene.objects if block not in own],
    }


def _name_blocks(channel, shown, blocks):
    """Give the objects and materials of a channel its display name.

    Names of prims cannot have spaces, slashes or a leading digit, so the stage encodes them.
    """
    if shown == channel:
        return
    for path, block in blocks:
        above, _, name = path.rpartition("/")
        if name == channel:
            block.name = shown
        elif name.startswith(f"{channel}_") and above.endswith(f"/{channel}"):
            block.name = f"{shown}{name.removeprefix(channel)}"


def _objects_of(prim_map):
    """Return Blender's objects by the path of their prim."""
    return {
        str(path): block
        for path, made in prim_map.items()
        for block in made
        if isinstance(block, bpy.types.Object)
    }


def matrix_of(path, objects):
    """Return an object's matrix relative to its nearest ancestor in `objects`, in stage units.

    The result is a list of rows, for column vectors. `objects` holds Blender's objects by the
    paths of their prims, including /Specimen.
    """
    block, above = objects[path], path.rpartition("/")[0]
    while above not in objects:
        above = above.rpartition("/")[0]
    frame = objects[above]
    if block.parent == frame and block.parent_type == "OBJECT" and not block.constraints:
        # The world matrices have 32-bit floats, so going through them would lose precision.
        return [list(row) for row in block.matrix_parent_inverse @ block.matrix_basis]
    return [list(row) for row in frame.matrix_world.inverted() @ block.matrix_world]


def _read_look(prim):
    def value(name):
        found = prim.GetAttribute(name).Get()
        if found is None:
            raise StageProblem(f"{prim.GetPath()}.{name}: no value")
        return found

    window = tuple(value("stereocell:window"))
    stored = prim.GetAttribute("stereocell:volumeWindow").Get()
    return {
        "color": list(value("inputs:color")),
        "points": fit_ramp(value("stereocell:opacityPoints")),
        "windows": [window, window if stored is None else tuple(stored)],
        "opacity": _opacity_of(prim),
        "function": prim.GetVariantSet("transferFunction").GetVariantSelection(),
    }


def _opacity_of(channel):
    """Return the opacity that a channel's shader states."""
    shader = channel.GetStage().GetPrimAtPath(channel.GetPath().AppendChild("surface"))
    value = shader.GetAttribute("inputs:opacity").Get() if shader else None
    return 1.0 if value is None else float(value)


def _color_surfaces(stage, channel, look, group, materials):
    for path, material in materials:
        prim = stage.GetPrimAtPath(path)
        if prim.GetParent().GetName() != channel or material.node_tree is None:
            continue
        source = stage.GetPrimAtPath(f"{CHANNELS}/{channel}")
        if source.GetAttribute(PAINTED).Get() or source.GetAttribute(COLUMNS).Get():
            continue  # Blender's importer already connects the image or the mesh's own colours
        own = prim.GetAttribute("inputs:color").Get()
        if own is None or list(own) == look["color"]:
            color_surface(material, group)
        else:
            set_surface_color(material, own)


def _shade_volumes(stage, root, channel, look, group, objects):
    volumes = {
        path: block
        for path, block in objects.items()
        if block.type == "VOLUME" and stage.GetPrimAtPath(path).GetParent().GetName() == channel
    }
    if not volumes:
        return
    modality = stage.GetPrimAtPath(ROOT).GetAttribute("stereocell:modality").Get()
    voxel = min(_voxel_um(stage.GetPrimAtPath(path)) for path in volumes)
    prim = stage.GetPrimAtPath(f"{CHANNELS}/{channel}")
    shown = prim.GetDisplayName() or channel
    material = make_volume_material(shown, group, look, voxel, glow_of(modality))
    root[VOLUME + channel] = material
    for block in volumes.values():
        block.data.materials.clear()
        block.data.materials.append(material)


def _voxel_um(volume):
    """Return the shortest edge of a volume's voxels."""
    names = ("boundsMin", "boundsMax", "atlasSize", "apron")
    low, high, size, apron = (volume.GetAttribute(f"stereocell:{name}").Get() for name in names)
    if low is None or high is None or size is None:
        raise StageProblem(f"{volume.GetPath()}: no stereocell:boundsMin, boundsMax or atlasSize")
    return min((high[k] - low[k]) / (size[k] - 2 * (apron or 0) - 1) for k in range(3))
