"""Colour, select, hide and rename the objects of label maps in Blender.

An object of a label map is a set of faces of its tile's mesh. The columns of its table row are
attributes of these faces.

The operators change the display with Blender's own means: shader nodes, and a modifier that removes
the faces of hidden objects. The edits themselves are kept on the root object, and overlay.py writes
them: the default column for colours, colours of single objects, hidden objects, names of classes.
"""

import json
from contextlib import contextmanager

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty, StringProperty

KEPT = "stereocell_objects"  # property of the root object: edits of objects by channel, as JSON
# Properties of a mesh in Blender: labels of the label map's objects (JSON), and its channel
LABELS = "stereocell_labels"
CHANNEL = "stereocell_channel"
OBJECT_ID, COLOR, HIDDEN = "objectId", "displayColor", "stereocell_hidden"
AS_STAGED = "AS_STAGED"
_NODE = "StereoCell column"  # label of the nodes that colour by a column
# Property of a material: the node and socket that fed its colour before it was coloured by a column
_BEFORE = "stereocell_before"
# Linear RGB of the colour map viridis (Smith & van der Walt), at even steps
_VIRIDIS = (
    (0.058, 0.0, 0.089), (0.045, 0.078, 0.256), (0.013, 0.275, 0.271), (0.119, 0.584, 0.129),
    (0.984, 0.799, 0.019),
)  # fmt: skip
_items = {}  # keeps the results of callbacks for enumerations alive; Blender does not


def read_columns(prim):
    """Return the columns and the default column of a channel; None if it is not a label map."""
    ids = prim.GetAttribute("stereocell:columns").Get()
    if ids is None:
        return None
    columns = {}
    for name in map(str, ids):
        attribute = prim.GetAttribute(f"stereocell:column:{name}")
        categories = attribute.GetCustomDataByKey("categories")
        columns[name] = {"name": str(attribute.Get()), "categories": list(categories or ())}
    default = str(prim.GetAttribute("stereocell:defaultColumn").Get() or "")
    return {"columns": columns, "default": default}


def keep_labels(stage, channels, objects):
    """Store the labels of its objects, and its channel, on each mesh of a label map."""
    for path, block in objects.items():
        labels = stage.GetPrimAtPath(path).GetAttribute("stereocell:objectLabels").Get()
        channel = stage.GetPrimAtPath(path).GetParent().GetName()
        if block.type == "MESH" and labels is not None and channel in channels:
            block[LABELS] = json.dumps([str(label) for label in labels])
            block[CHANNEL] = channel


def kept(root):
    """Return the edits of the objects of label maps that the root object keeps, by channel.

    Each channel's edits have the keys `default` (the column for colours), `colors` (by label),
    `hidden` (labels), and `classes` (names of categories, by column).
    """
    return json.loads(root.get(KEPT, "{}"))


def _mean(root, channel, **change):
    all_of_it = kept(root)
    all_of_it[channel] = {**all_of_it.get(channel, {}), **change}
    root[KEPT] = json.dumps(all_of_it)


def _root(context):
    block = context.view_layer.objects.active
    while block is not None and "stereocell" not in block:
        block = block.parent
    if block is None:
        block = next((one for one in context.scene.objects if "stereocell" in one), None)
    return block


def _described(root):
    """Return the first label map of a specimen and its columns; others are not offered."""
    state = json.loads(root["stereocell"]) if root is not None else {}
    found = [(name, look["objects"]) for name, look in state.get("channels", {}).items()
             if look.get("objects")]  # fmt: skip
    return found[0] if found else ("", {"columns": {}, "default": ""})


def _meshes(context, channel):
    return [one for one in context.scene.objects if one.get(CHANNEL) == channel]


def _values(block, name, kind=np.float32):
    """Return an attribute of a mesh's faces (n,); None if the faces do not have it."""
    attribute = block.data.attributes.get(name)
    if attribute is None or attribute.domain != "FACE":
        return None
    values = np.empty(len(block.data.polygons), kind)
    attribute.data.foreach_get("value", values)
    return values


def _column_items(_self, context):
    columns = _described(_root(context))[1]["columns"]
    _items["columns"] = [(AS_STAGED, "As in the stage", "")] + [
        (name, one["name"], "") for name, one in columns.items()
    ]
    return _items["columns"]


def _class_items(_self, context):
    channel, described = _described(_root(context))
    named = kept(_root(context)).get(channel, {}).get("classes", {}) if channel else {}
    _items["classes"] = [
        (f"{column}/{code}", f"{one['name']}: {named.get(column, one['categories'])[code]}", "")
        for column, one in described["columns"].items()
        for code in range(len(one["categories"]))
    ] or [("", "No classes", "")]
    return _items["classes"]


class _OfObjects(bpy.types.Operator):
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context):
        return bool(_described(_root(context))[0])


class ColorBy(_OfObjects):
    """Colour the objects by a column; the phone opens by it, too"""

    bl_idname = "stereocell.color_by"
    bl_label = "Colour by"
    column: EnumProperty(name="Column", items=_column_items)

    def execute(self, context):
        root = _root(context)
        channel, described = _described(root)
        _mean(root, channel, default=None if self.column == AS_STAGED else self.column)
        _show(context, channel, described, self.column)
        return {"FINISHED"}


class SelectClass(_OfObjects):
    """Select the faces of all objects of a class"""

    bl_idname = "stereocell.select_class"
    bl_label = "Select class"
    category: EnumProperty(name="Class", items=_class_items)

    def execute(self, context):
        column, _, code = self.category.rpartition("/")
        _select(context, _described(_root(context))[0], lambda b: _values(b, column) == int(code))
        return {"FINISHED"}


class HideByValue(_OfObjects):
    """Hide the objects whose value lies outside; those without a value go, too"""

    bl_idname = "stereocell.hide_by_value"
    bl_label = "Hide by value"
    column: EnumProperty(name="Column", items=_column_items)
    low: FloatProperty(name="Lowest")
    high: FloatProperty(name="Highest", default=1e30)

    def execute(self, context):
        root = _root(context)
        channel, _ = _described(root)

        def outside(block):
            values = _values(block, self.column)
            return None if values is None else ~((values >= self.low) & (values <= self.high))

        _hide(context, root, channel, outside)
        return {"FINISHED"}


class HideSelected(_OfObjects):
    """Hide the objects that have a selected face"""

    bl_idname = "stereocell.hide_selected"
    bl_label = "Hide the selected objects"

    def execute(self, context):
        root = _root(context)
        _hide(context, root, _described(root)[0], _selected)
        return {"FINISHED"}


class ShowAll(_OfObjects):
    """Show all objects again"""

    bl_idname = "stereocell.show_all"
    bl_label = "Show all objects"

    def execute(self, context):
        root = _root(context)
        channel, _ = _described(root)
        _mean(root, channel, hidden=[])
        _draw_hidden(context, channel, set())
        return {"FINISHED"}


class ColorSelected(_OfObjects):
    """Give the objects that have a selected face a colour of their own"""

    bl_idname = "stereocell.color_selected"
    bl_label = "Colour the selected objects"
    color: FloatVectorProperty(
        name="Colour", subtype="COLOR", size=3, min=0, max=1, default=(0.8, 0.1, 0.1)
    )

    def execute(self, context):
        root = _root(context)
        channel, described = _described(root)
        colors = dict(kept(root).get(channel, {}).get("colors", {}))
        for block in _meshes(context, channel):
            objects, labels = _values(block, OBJECT_ID, np.int32), json.loads(block[LABELS])
            which = np.unique(objects[_selected(block)])
            colors |= {labels[place]: list(self.color) for place in which.tolist()}
            _paint(block, np.isin(objects, which), self.color)
        _mean(root, channel, colors=colors, default="")
        _show(context, channel, described, COLOR)
        return {"FINISHED"}


class RenameClass(_OfObjects):
    """Give a class another name"""

    bl_idname = "stereocell.rename_class"
    bl_label = "Rename class"
    category: EnumProperty(name="Class", items=_class_items)
    name: StringProperty(name="Name")

    def execute(self, context):
        root = _root(context)
        channel, described = _described(root)
        column, _, code = self.category.rpartition("/")
        classes = dict(kept(root).get(channel, {}).get("classes", {}))
        names = list(classes.get(column, described["columns"][column]["categories"]))
        others = names[: int(code)] + names[int(code) + 1 :]
        if not self.name.strip() or self.name in others:
            self.report({"ERROR"}, f"class {names[int(code)]}: expected a name that no other has")
            return {"CANCELLED"}
        names[int(code)] = self.name.strip()
        _mean(root, channel, classes={**classes, column: names})
        return {"FINISHED"}

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)


class ObjectsPanel(bpy.types.Panel):
    """The panel beside the 3D view that edits the objects of a label map."""

    bl_idname = "VIEW3D_PT_stereocell_objects"
    bl_label = "Objects"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "StereoCell"

    @classmethod
    def poll(cls, context):
        return bool(_described(_root(context))[0])

    def draw(self, _context):
        for operator in (ColorBy, SelectClass):
            names = {ColorBy: "column", SelectClass: "category"}
            self.layout.operator_menu_enum(operator.bl_idname, names[operator])
        for operator in (ColorSelected, HideSelected, HideByValue, ShowAll, RenameClass):
            self.layout.operator(operator.bl_idname)


CLASSES = (
    ColorBy, SelectClass, HideByValue, HideSelected, ShowAll, ColorSelected, RenameClass,
    ObjectsPanel,
)  # fmt: skip


def _selected(block):
    if block.mode == "EDIT":
        block.update_from_editmode()
    chosen = np.empty(len(block.data.polygons), bool)
    block.data.polygons.foreach_get("select", chosen)
    return chosen


def _select(context, channel, which):
    for block in _meshes(context, channel):
        found = which(block)
        if found is None or found.shape == ():
            continue
        mesh = block.data
        for parts in (mesh.vertices, mesh.edges):
            parts.foreach_set("select", np.zeros(len(parts), bool))
        mesh.polygons.foreach_set("select", np.ascontiguousarray(found))
        mesh.update()


def _paint(block, faces, color):
    """Set the colour of some faces; Blender's importer stores colours at the faces' corners."""
    attribute = block.data.attributes.get(COLOR)
    if attribute is None:
        attribute = block.data.attributes.new(COLOR, "FLOAT_COLOR", "CORNER")
    if attribute.domain == "CORNER":
        counts = np.empty(len(block.data.polygons), np.int32)
        block.data.polygons.foreach_get("loop_total", counts)
        faces = np.repeat(faces, counts)
    values = np.empty(4 * len(faces), np.float32)
    attribute.data.foreach_get("color", values)
    values.reshape(-1, 4)[faces, :3] = color
    attribute.data.foreach_set("color", values)
    block.data.update()


def _hide(context, root, channel, which):
    hidden = set(kept(root).get(channel, {}).get("hidden", ()))
    for block in _meshes(context, channel):
        faces = which(block)
        if faces is not None:
            labels = json.loads(block[LABELS])
            places = np.unique(_values(block, OBJECT_ID, np.int32)[faces])
            hidden |= {labels[place] for place in places.tolist()}
    _mean(root, channel, hidden=sorted(hidden, key=int))
    _draw_hidden(context, channel, hidden)


def _draw_hidden(context, channel, hidden):
    for block in _meshes(context, channel):
        labels = json.loads(block[LABELS])
        places = [place for place, label in enumerate(labels) if label in hidden]
        attributes = block.data.attributes
        attribute = attributes.get(HIDDEN) or attributes.new(HIDDEN, "BOOLEAN", "FACE")
        faces = np.isin(_values(block, OBJECT_ID, np.int32), places)
        attribute.data.foreach_set("value", faces)
        if block.modifiers.get(HIDDEN) is None:
            block.modifiers.new(HIDDEN, "NODES").node_group = _left_out()
        block.data.update()


def _left_out():
    """Return the geometry nodes that delete the faces of hidden objects; make them if needed."""
    tree = bpy.data.node_groups.get(HIDDEN)
    if tree is not None:
        return tree
    tree = bpy.data.node_groups.new(HIDDEN, "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    given, made = (tree.nodes.new(f"NodeGroup{name}") for name in ("Input", "Output"))
    named = tree.nodes.new("GeometryNodeInputNamedAttribute")
    named.data_type = "BOOLEAN"
    named.inputs["Name"].default_value = HIDDEN
    drop = tree.nodes.new("GeometryNodeDeleteGeometry")
    drop.domain = "FACE"
    tree.links.new(given.outputs[0], drop.inputs["Geometry"])
    tree.links.new(named.outputs["Attribute"], drop.inputs["Selection"])
    tree.links.new(drop.outputs["Geometry"], made.inputs[0])
    return tree


def _materials(context, channel):
    blocks = _meshes(context, channel)
    found = {slot.material for block in blocks for slot in block.material_slots if slot.material}
    return sorted(found, key=lambda material: material.name)


def _show(context, channel, described, column):
    """Colour a channel's materials by a column, by the objects' own colours, or as in the stage.

    The colour map of a numeric column spans the 0.1th to the 99.9th percentile of its values.
    """
    for material in _materials(context, channel):
        _undress(material)
    if column == AS_STAGED:
        return
    values = [_values(block, column) for block in _meshes(context, channel)]
    known = np.concatenate([one[np.isfinite(one)] for one in values if one is not None] or [[]])
    low, high = np.percentile(known, [0.1, 99.9]) if len(known) else (0.0, 1.0)
    count = len(described["columns"].get(column, {}).get("categories", ()))
    if count:
        low, high = 0.0, max(count - 1.0, 1.0)
    for material in _materials(context, channel):
        _dress(material, column, float(low), float(max(high, low + 1e-6)))


def _surface(material):
    nodes = material.node_tree.nodes if material.node_tree else ()
    return next((one for one in nodes if one.bl_idname == "ShaderNodeBsdfPrincipled"), None)


def _dress(material, column, low, high):
    surface = _surface(material)
    if surface is None:
        return
    tree, socket = material.node_tree, surface.inputs["Base Color"]
    if socket.links:
        link = socket.links[0]
        material[_BEFORE] = json.dumps([link.from_node.name, link.from_socket.identifier])
    attribute = tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = column
    attribute.label = _NODE
    if column == COLOR:
        tree.links.new(attribute.outputs["Color"], socket)
        return
    window, ramp = (tree.nodes.new(f"ShaderNode{name}") for name in ("MapRange", "ValToRGB"))
    window.label = ramp.label = _NODE
    window.inputs["From Min"].default_value, window.inputs["From Max"].default_value = low, high
    elements = ramp.color_ramp.elements
    for place, color in enumerate(_VIRIDIS):
        position = place / (len(_VIRIDIS) - 1)
        element = elements[0] if place == 0 else elements[-1] if position == 1 else None
        element = element or elements.new(position)
        element.color = (*color, 1.0)
    tree.links.new(attribute.outputs["Fac"], window.inputs["Value"])
    tree.links.new(window.outputs["Result"], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs["Color"], socket)


def _undress(material):
    surface = _surface(material)
    if surface is None:
        return
    tree = material.node_tree
    for node in [node for node in tree.nodes if node.label == _NODE]:
        tree.nodes.remove(node)
    if _BEFORE in material:
        name, identifier = json.loads(material[_BEFORE])
        node = tree.nodes.get(name)
        outputs = [one for one in node.outputs if one.identifier == identifier] if node else []
        for output in outputs[:1]:
            tree.links.new(output, surface.inputs["Base Color"])
        del material[_BEFORE]


@contextmanager
def as_staged(context, root):
    """Remove the nodes that colour by a column while the block runs, and add them again.

    The export then compares the materials without these nodes.
    """
    channel, described = _described(root)
    for material in _materials(context, channel):
        _undress(material)
    try:
        yield
    finally:
        edits = kept(root).get(channel, {})
        default = edits.get("default")
        if default is not None:
            _show(context, channel, described, COLOR if default == "" else default)
