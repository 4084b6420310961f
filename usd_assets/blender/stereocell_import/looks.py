"""Build the colour and the volume shader of a channel, which Blender's importer drops.

Each channel has one node group with its colour. All of its mesh and volume materials use this
group, so a channel is recoloured in one place, as in the stage. Blender's own importer gives each
material the plain value of its shader instead: the colour at the time of the build.

Each channel has one volume material. Its colour ramp is the transfer function: positions are
intensities, alphas are opacities.

An opacity holds for the length of one voxel, as in the bundle's viewer: the extinction per um is
-ln(1 - opacity) / voxel. Blender measures densities in object space, so a scaled specimen looks the
same. Voxels glow as a fluorescent stain does. Volumes of MR and CT do not: a glow would drown the
shading of opaque tissue.
"""

import math

import bpy

from .problem import StageProblem

GLOW = 0.4  # emission per density of absorption
_MODALITIES_LIT = ("MR", "CT")  # DICOM's codes of the modalities whose volumes do not glow
_MAX_POINTS = 32  # Blender's limit for the points of a colour ramp
_MIN_PASSED = 0.001  # least transmission of a voxel, 0..1; an opacity of 1 has no logarithm


def make_color_group(channel, color, opacity=1.0):
    """Return a node group whose outputs are a channel's linear colour and its surfaces' opacity."""
    group = bpy.data.node_groups.new(f"{channel} colour", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    rgb = group.nodes.new("ShaderNodeRGB")
    rgb.label = channel
    rgb.outputs[0].default_value = (*color, 1.0)
    group.interface.new_socket("Opacity", in_out="OUTPUT", socket_type="NodeSocketFloat")
    value = group.nodes.new("ShaderNodeValue")
    value.label = "opacity"
    value.location.y = -200
    value.outputs[0].default_value = opacity
    output = group.nodes.new("NodeGroupOutput")
    output.location.x = 200
    group.links.new(rgb.outputs[0], output.inputs[0])
    group.links.new(value.outputs[0], output.inputs[1])
    return group


def color_of(group):
    """Return the linear colour of a group that `make_color_group` made. Raises StageProblem."""
    for node in group.nodes:
        if node.bl_idname == "ShaderNodeRGB":
            return tuple(node.outputs[0].default_value)[:3]
    raise StageProblem(f"node group {group.name!r} has no RGB node, expected its channel's colour")


def opacity_of(group):
    """Return the opacity of a group that `make_color_group` made, 0..1. Raises StageProblem."""
    for node in group.nodes:
        if node.bl_idname == "ShaderNodeValue":
            return min(1.0, max(0.0, node.outputs[0].default_value))
    raise StageProblem(f"node group {group.name!r} has no Value node, expected its opacity")


def plain_values(material):
    """Return a material's values as inputs of a UsdPreviewSurface, and the inputs that have images.

    Colours are linear RGB, 0..1. Values that other nodes calculate count as images.
    """
    found = {"diffuseColor": tuple(material.diffuse_color)[:3], "roughness": material.roughness}
    found["metallic"] = material.metallic
    images = []
    nodes = material.node_tree.nodes if material.node_tree else ()
    surface = next((n for n in nodes if n.bl_idname == "ShaderNodeBsdfPrincipled"), None)
    if surface is None:
        return found, images
    for name, socket in (
        ("diffuseColor", surface.inputs["Base Color"]),
        ("metallic", surface.inputs["Metallic"]),
        ("roughness", surface.inputs["Roughness"]),
        ("opacity", surface.inputs["Alpha"]),
    ):
        source = socket.links[0].from_node if socket.links else None
        group = getattr(source, "node_tree", None)
        if group is not None and name == "diffuseColor":
            found[name] = color_of(group)  # a copied surface keeps its channel's group
        elif group is not None and name == "opacity":
            found[name] = opacity_of(group)
        elif source is not None:
            images.append(socket.name)
        else:
            value = socket.default_value
            found[name] = value if isinstance(value, float) else tuple(value)[:3]
    found["diffuseColor"] = _at_most_1(found["diffuseColor"])
    strength = surface.inputs["Emission Strength"].default_value
    glow = [strength * part for part in surface.inputs["Emission Color"].default_value[:3]]
    if max(glow) > 0:
        found["emissiveColor"] = _at_most_1(glow)
    return found, images


def _at_most_1(color):
    """Return a colour of the same hue whose components are at most 1, the limit of a bundle."""
    return tuple(part / max(1.0, *color) for part in color)


def color_surface(material, group):
    """Connect a channel's colour and opacity to a material that Blender's importer made."""
    tree = material.node_tree
    for surface in [node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled"]:
        node = _feed(tree, group, surface, "Base Color")
        tree.links.new(node.outputs["Opacity"], surface.inputs["Alpha"])
    material.diffuse_color = (*color_of(group), 1.0)  # the colour in viewports without shading


def set_surface_color(material, color):
    """Give a tile's material its own colour, where the stage overrides the channel's colour."""
    for node in material.node_tree.nodes:
        if node.bl_idname == "ShaderNodeBsdfPrincipled":
            node.inputs["Base Color"].default_value = (*color, 1.0)
    material.diffuse_color = (*color, 1.0)


def glow_of(modality):
    """Return the emission of a modality's volumes, per density of absorption."""
    return 0.0 if modality in _MODALITIES_LIT else GLOW


def make_volume_material(channel, group, look, voxel_um, glow):
    """Return the material of a channel's volumes.

    look      `points` is the transfer function from `fit_ramp`: pairs of intensity and opacity,
              0..1, by rising intensity; `windows` is the pair of voxel values that are shown as 0
              and 1, then the pair of voxel values that the volumes store as 0 and 1
    voxel_um  shortest voxel edge of the channel's volumes, um
    glow      emission per density of absorption
    """
    points, windows = look["points"], look["windows"]
    material = bpy.data.materials.new(f"{channel} volume")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    info = _node(tree, "ShaderNodeVolumeInfo", -1000)
    window = _node(tree, "ShaderNodeMapRange", -800)
    (low, high), (first, last) = windows
    window.inputs["From Min"].default_value = (low - first) / (last - first)
    window.inputs["From Max"].default_value = (high - first) / (last - first)
    ramp = _node(tree, "ShaderNodeValToRGB", -600)
    ramp.label = "transfer function"
    _fill_ramp(ramp.color_ramp, points)
    tree.links.new(info.outputs["Density"], window.inputs["Value"])
    tree.links.new(window.outputs["Result"], ramp.inputs["Fac"])

    passed = _math(tree, "SUBTRACT", -300, 1.0, ramp.outputs["Alpha"])
    passed = _math(tree, "MAXIMUM", -150, passed, _MIN_PASSED)
    depth = _math(tree, "LOGARITHM", 0, passed, math.e)
    density = _math(tree, "MULTIPLY", 150, depth, -1 / voxel_um)
    emission = _math(tree, "MULTIPLY", 300, density, glow)

    shader = _node(tree, "ShaderNodeVolumePrincipled", 500)
    shader.inputs["Density Attribute"].default_value = ""  # use the ramp's density, not the grid's
    tree.links.new(density, shader.inputs["Density"])
    tree.links.new(emission, shader.inputs["Emission Strength"])
    _feed(tree, group, shader, "Color", "Emission Color")
    output = _node(tree, "ShaderNodeOutputMaterial", 800)
    tree.links.new(shader.outputs["Volume"], output.inputs["Volume"])
    return material


def fit_ramp(points):
    """Return a transfer function with at most as many points as Blender's colour ramp can hold.

    Inner points are removed one by one. The next one is always the point whose removal changes the
    area below the function least (Visvalingam and Whyatt, 1993).
    """
    kept = [list(point) for point in points]
    while len(kept) > _MAX_POINTS:
        changes = [_triangle_area(*kept[n - 1 : n + 2]) for n in range(1, len(kept) - 1)]
        del kept[1 + changes.index(min(changes))]
    return kept


def _triangle_area(one, middle, other):
    """Return the change of area below a function when its middle point is removed."""
    (x0, y0), (x1, y1), (x2, y2) = one, middle, other
    return abs((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)) / 2


def points_of(material):
    """Return the transfer function of a material that `make_volume_material` made."""
    for node in material.node_tree.nodes:
        if node.bl_idname == "ShaderNodeValToRGB":
            return [(e.position, e.color[3]) for e in node.color_ramp.elements]
    raise StageProblem(f"material {material.name!r} has no colour ramp, expected its opacities")


def _fill_ramp(ramp, points):
    ramp.interpolation = "LINEAR"
    while len(ramp.elements) > 1:
        ramp.elements.remove(ramp.elements[-1])
    ramp.elements[0].position = points[0][0]
    for intensity, _ in points[1:]:
        ramp.elements.new(intensity)
    for element, (_, opacity) in zip(ramp.elements, points, strict=True):
        element.color = (1.0, 1.0, 1.0, opacity)


def _feed(tree, group, shader, *inputs):
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.location = (shader.location.x - 250, shader.location.y + 150)
    for name in inputs:
        tree.links.new(node.outputs[0], shader.inputs[name])
    return node


def _node(tree, kind, x):
    node = tree.nodes.new(kind)
    node.location.x = x
    return node


def _math(tree, operation, x, *values):
    """Add a Math node and return its output; `values` are numbers or other nodes' outputs."""
    node = _node(tree, "ShaderNodeMath", x)
    node.operation = operation
    for socket, value in zip(node.inputs, values, strict=False):
        if isinstance(value, float):
            socket.default_value = value
        else:
            tree.links.new(value, socket)
    return node.outputs[0]
