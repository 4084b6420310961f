"""Record the state of an imported object, so that the export can find the edits made since.

overlay.py writes the edits that a layer can carry. `find_losses` names the others.
"""

import hashlib
import json

import bpy
import numpy as np

from .objects import HIDDEN

OF_CHANNEL = "a tile's surface has the colour of its channel"
_LAYOUT = {
    *("name", "label", "width", "height", "hide", "select", "mute", "parent", "show_options"),
    *("show_preview", "show_texture", "use_custom_color", "warning_propagation"),
}


def take_snapshot(block):
    """Return the state of an object that an export compares, as values that JSON can store."""
    found = {"name": block.name, "modifiers": _modifiers(block)}
    if block.type == "MESH":
        mesh = block.data
        found |= {
            "points": _digest(points_of_mesh(mesh)),
            "faces": [
                len(mesh.vertices),
                _digest(_read(mesh.loops, "vertex_index", np.int32)),
                _digest(_read(mesh.polygons, "loop_total", np.int32)),
            ],
            "uvs": [_digest(_read(one.uv, "vector", np.float32, 2)) for one in mesh.uv_layers],
        }
    if block.type in ("MESH", "VOLUME"):
        found["materials"] = [slot.material and slot.material.name for slot in block.material_slots]
    return found


def _modifiers(block):
    # A layer carries hidden objects, so the modifier that hides them is not compared.
    return [one.name for one in block.modifiers if one.name != HIDDEN]


def take_materials(blocks):
    """Return a digest of each material's nodes, by its name."""
    used = {slot.material for block in blocks for slot in block.material_slots if slot.material}
    return {material.name: digest_nodes(material.node_tree) for material in used}


def points_of_mesh(mesh):
    """Return the positions of a mesh's vertices in its own space, float32 (n, 3)."""
    return _read(mesh.vertices, "co", np.float32, 3)


def find_losses(block, before):
    """Yield one line for each edit of an object that a layer cannot carry.

    `before` is the object's snapshot. The lines are worded like those of `stereocell bundle`.
    """
    now, name = take_snapshot(block), before["name"]
    if now["name"] != name:
        yield f"name {now['name']!r} of {name} is not taken over: the stage names its prims"
    for modifier in now["modifiers"]:
        if modifier not in before["modifiers"]:
            yield f"modifier {modifier} of {name} is not taken over: apply it"
    if now.get("materials") != before.get("materials"):
        yield f"material of {name} is not taken over: {OF_CHANNEL}"
    if block.type == "MESH":
        if now["faces"] != before["faces"]:
            yield f"topology of {name} is not taken over: its vertices, edges or faces are others"
        elif now["uvs"] != before["uvs"]:
            yield f"a change of UVs of {name} is not taken over: textures follow those of the build"
        if block.data.shape_keys is not None:
            yield f"shape key of {name} is not taken over: apply it"
    moving = [one.animation_data for one in (block, block.data) if one is not None]
    if any(one is not None and (one.action or one.drivers) for one in moving):
        yield f"animation of {name} is not taken over but for this frame: nothing moves here"


def digest_nodes(tree):
    """Return a digest of a shader's nodes, without the values that a layer carries.

    These are a channel's colour and opacity, and the positions and opacities of its ramp.
    """
    return _hash(_describe_nodes(tree))


def _describe_nodes(tree):
    if tree is None:
        return None
    nodes = [
        [
            node.name,
            node.bl_idname,
            {key: _plain(getattr(node, key)) for key in _properties(node)},
            [_plain(getattr(one, "default_value", None)) for one in node.inputs],
            [] if _is_of_channel(tree, node) else
            [_plain(getattr(one, "default_value", None)) for one in node.outputs],
            _describe_nodes(getattr(node, "node_tree", None)),
            _describe_ramp(getattr(node, "color_ramp", None)),
            getattr(getattr(node, "image", None), "filepath", ""),
        ]
        for node in tree.nodes
    ]  # fmt: skip
    links = [
        [link.from_node.name, link.from_socket.identifier, link.to_node.name,
         link.to_socket.identifier]
        for link in tree.links
    ]  # fmt: skip
    return [sorted(nodes, key=lambda node: node[0]), sorted(links)]


def _is_of_channel(tree, node):
    is_value = node.bl_idname in ("ShaderNodeRGB", "ShaderNodeValue")
    return is_value and isinstance(tree.id_data, bpy.types.NodeTree)


def _describe_ramp(ramp):
    if ramp is None:
        return None
    colors = {tuple(round(part, 5) for part in element.color[:3]) for element in ramp.elements}
    return [ramp.interpolation, ramp.color_mode, sorted(colors)]


def _properties(node):
    """Return the names of the settings that affect a node's result, not its place in the editor."""
    kinds = ("BOOLEAN", "INT", "FLOAT", "STRING", "ENUM")
    return sorted(
        one.identifier
        for one in node.bl_rna.properties
        if one.type in kinds
        and not one.is_readonly
        and one.identifier not in _LAYOUT
        and not one.identifier.startswith(("location", "color", "bl_"))
    )


def _plain(value):
    if isinstance(value, float):
        return round(value, 5)
    if value is None or isinstance(value, bool | int | str):
        return value
    try:
        return [_plain(part) for part in value]
    except TypeError:
        return getattr(value, "name", "")


def _hash(content):
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


def _digest(array):
    return hashlib.sha256(array.tobytes()).hexdigest()[:16]


def _read(items, name, kind, width=1):
    values = np.empty(len(items) * width, kind)
    items.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values
