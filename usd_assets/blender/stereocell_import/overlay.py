"""Write an artist's edits as a layer over the stage, for `stereocell bundle OUT --stage LAYER`.

The layer carries these edits:

- colours in a channel's colour group, and opacities in a volume material's ramp
- objects that were hidden or deleted
- tiles, meshes and volumes that were moved, and moved points of meshes
- lights, and the variants that were chosen at the import
- edits of the objects of label maps (objects.py)
- objects that were added to the scene (additions.py)

Other edits of the specimen are lost, and the export lists them. The position of the whole specimen
in the scene is not an edit.
"""

import json
import os
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

from .additions import CAMERAS, LIGHTS, write_additions
from .choice import CHANNELS, METERS_PER_UNIT, ROOT, TILES, open_stage
from .importing import COLOR, PRIM, STATE, VOLUME, matrix_of
from .layer_values import set_value
from .lighting import intensity_of, light_values
from .looks import color_of, opacity_of, points_of
from .objects import CHANNEL, LABELS, as_staged, kept
from .problem import StageProblem
from .shapes import cut_fans, group_seams, turn_with
from .snapshot import digest_nodes, find_losses, points_of_mesh, take_snapshot

BUILT_CAMERAS = ("mono", "left", "right")
_IN_GROUP = "a channel's colour and opacity are values of its node group"
_MOVED = 1e-4  # relative tolerance; true-size matrices are 32-bit floats with a scale of 1e-6


@dataclass(frozen=True)
class Edits:
    """One line for each edit that the layer carries, and one for each that it does not carry."""

    carried: list[str]
    lost: list[str]

    def summary(self):
        carried = f"{len(self.carried)} edits: " + "; ".join(self.carried)
        return f"{carried}. Not carried: " + "; ".join(self.lost) if self.lost else carried


def export_edits(context, path):
    """Write the edits since the import as a layer; return a list of them. Raises StageProblem."""
    root = _find_root(context)
    state = json.loads(root[STATE])
    stage_path, path = Path(state["stage"]), Path(bpy.path.abspath(str(path)))
    stage = open_stage(stage_path)
    used = {Path(layer.realPath).resolve() for layer in stage.GetUsedLayers() if layer.realPath}
    if path.resolve() in used:
        raise StageProblem(f"{path}: a layer of the stage itself, expected a file of its own")
    context.view_layer.update()
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.defaultPrim = ROOT.strip("/")
    layer.pseudoRoot.SetInfo("metersPerUnit", METERS_PER_UNIT)
    layer.pseudoRoot.SetInfo("upAxis", "Y")
    layer.subLayerPaths = [_name_of(stage_path, path)]
    Sdf.CreatePrimInLayer(layer, ROOT)  # the default prim must exist even if nothing was edited
    objects, strangers = _find_objects(context, root, state)
    lost = []
    edits = [
        *_write_looks(layer, stage, root, state),
        *_write_variants(layer, state),
        *_write_hidden(layer, state, objects),
        *_write_moved(layer, state, root, objects, lost),
        *_write_points(layer, stage, state, objects, lost),
        *_write_objects(layer, stage, root, objects),
        *_write_lights(layer, stage, state, objects),
        *write_additions(context, layer, stage, root, strangers, lost),
    ]
    _write_hints(layer, stage, state, root, objects)
    _widen_root(layer, stage)
    with as_staged(context, root):
        lost += _find_losses(context, state, objects)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        if not layer.Export(str(temporary)):
            raise StageProblem(f"{path}: can't be written")
        temporary.replace(path)
    except OSError as error:
        raise StageProblem(f"{path}: can't be written: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)
    return Edits(edits, lost)


def _find_root(context):
    """Return the root of the specimen that has the active object, or of the only specimen.

    Raises StageProblem if there is no specimen, or if none of several is active.
    """
    block = context.view_layer.objects.active
    while block is not None and STATE not in block:
        block = block.parent
    if block is not None:
        return block
    found = [block for block in context.scene.objects if STATE in block]
    if len(found) != 1:
        raise StageProblem(f"{len(found)} imported stages in the scene, expected one selected")
    return found[0]


def _find_objects(context, root, state):
    """Return the specimen's objects by the paths of their prims, and the objects added since."""
    objects, strangers = {}, []
    known = {one["name"] for one in state["snapshots"].values()} | set(state["others"])
    for block in sorted(context.scene.objects, key=lambda block: block.name not in known):
        path = block.get(PRIM)
        if _is_below(root, block) and path in state["snapshots"] and path not in objects:
            objects[path] = block
        elif _is_below(root, block) or (path is None and block.name not in state["others"]):
            strangers.append(block)
    for block in objects.values():
        if block.type == "MESH" and block.mode == "EDIT":
            block.update_from_editmode()
    return objects, sorted(strangers, key=lambda block: block.name)


def _find_losses(context, state, objects):
    """Return one line for each edit of the specimen that the layer does not carry."""
    lost = []
    for path, before in state["snapshots"].items():
        block = objects.get(path)
        if block is not None:
            lost += find_losses(block, before)
        elif path in state["leaves"] and any(
            one.get(PRIM) == path for one in context.scene.objects
        ):
            lost.append(
                f"{before['name']} is not taken over where it is: it was taken out of the "
                "specimen, which leaves it out"
            )
        elif (
            path.rpartition("/")[0] != TILES
            and path not in state["leaves"]
            and path not in state["lights"]
        ):
            lost.append(f"the removal of {before['name']} is not taken over: hide or remove tiles")
    for name, before in state["materials"].items():
        material = bpy.data.materials.get(name)
        if material is None:
            lost.append(f"the removal or name of material {name} is not taken over: {_IN_GROUP}")
        elif digest_nodes(material.node_tree) != before:
            lost.append(f"material {name} is not taken over, whose nodes changed: {_IN_GROUP}")
    world = context.scene.world
    if state["world"] and (world is None or digest_nodes(world.node_tree) != state["world"]):
        lost.append("the world is not taken over: edit the dome of the stage in a layer of USD")
    return lost


def _is_below(root, block):
    while block is not None and block != root:
        block = block.parent
    return block == root


def _name_of(stage, layer):
    """Return the path from a layer to its stage, relative so that both can be moved together."""
    try:
        relative = os.path.relpath(stage.resolve(), layer.resolve().parent)
    except ValueError:  # on Windows, if the layer is on another drive than the stage
        return stage.as_posix()
    name = Path(relative).as_posix()
    return name if name.startswith("..") else f"./{name}"


def _write_looks(layer, stage, root, state):
    for channel, look in state["channels"].items():
        path = f"{CHANNELS}/{channel}"
        group, material = root.get(COLOR + channel), root.get(VOLUME + channel)
        color = look["color"] if group is None else color_of(group)
        if _differ([color], [look["color"]]):
            set_value(layer, path, "inputs:color", Sdf.ValueTypeNames.Color3f, Gf.Vec3f(*color))
            yield f"{channel}: colour"
        opacity = look["opacity"] if group is None else opacity_of(group)
        if _differ([[opacity]], [[look["opacity"]]]):
            surface = f"{path}/surface"
            set_value(layer, surface, "inputs:opacity", Sdf.ValueTypeNames.Float, opacity)
            yield f"{channel}: opacity"
        prim = stage.GetPrimAtPath(path)
        function = prim.GetVariantSet("transferFunction").GetVariantSelection()
        if look["function"] != function:
            over = Sdf.CreatePrimInLayer(layer, path)
            over.variantSelections["transferFunction"] = look["function"]
            yield f"{channel}: transfer function {look['function']}"
        points = look["points"] if material is None else points_of(material)
        if _differ(points, look["points"]):
            pairs = Vt.Vec2fArray([Gf.Vec2f(*pair) for pair in points])
            place = path
            if look["function"]:  # points go into the function's variant; other functions stay
                variant = Sdf.CreateVariantInLayer(
                    layer, path, "transferFunction", look["function"]
                )
                place = variant.primSpec.path
            kind = Sdf.ValueTypeNames.Float2Array
            set_value(layer, place, "stereocell:opacityPoints", kind, pairs)
            yield f"{channel}: opacities"


def _write_variants(layer, state):
    for tile, chosen in state["chosen"].items():
        for name, variant in sorted(chosen.items()):
            over = Sdf.CreatePrimInLayer(layer, f"{TILES}/{tile}")
            over.variantSelections[name] = variant
            yield f"{tile}: {name} {variant}"


def _write_hidden(layer, state, objects):
    hidden = [path for path in state["leaves"] if _is_hidden(objects.get(path))]
    for tile in state["chosen"]:
        path = f"{TILES}/{tile}"
        inside = [leaf for leaf in state["leaves"] if leaf.startswith(f"{path}/")]
        if _is_hidden(objects.get(path)) or (inside and set(inside) <= set(hidden)):
            _hide(layer, path)
            yield f"{tile}: hidden"
            continue
        for leaf in inside:
            if leaf in hidden:
                _hide(layer, leaf)
                yield f"{leaf.rsplit('/', 1)[1]}: hidden"
    for leaf in hidden:
        if not leaf.startswith(f"{TILES}/"):  # a mesh that an earlier export added
            _hide(layer, leaf)
            yield f"{leaf.rsplit('/', 1)[1]}: hidden"


def _is_hidden(block):
    return block is None or block.hide_render or not block.visible_get()


def _hide(layer, path):
    set_value(layer, path, "visibility", Sdf.ValueTypeNames.Token, "invisible")


def _write_moved(layer, state, root, objects, lost):
    """Write the new positions of moved objects, and yield one line for each.

    A move that a bundle does not take over is appended to `lost`.
    """
    for path, before in state["matrices"].items():
        block = objects.get(path)
        matrix = before if block is None else matrix_of(path, {ROOT: root, **objects})
        if not _differ(matrix, before, _MOVED):
            continue
        name = path.rpartition("/")[2]
        is_field = path.rpartition("/")[0] in state["leaves"]  # a field of a volume
        if is_field or not _is_placed(path, state):
            lost.append(f"the place of {name} is not taken over: {_why_it_stays(path, is_field)}")
            continue
        rows = [[round(float(v), 6) for v in row] for row in zip(*matrix, strict=True)]
        kind = Sdf.ValueTypeNames
        set_value(layer, path, "xformOp:transform", kind.Matrix4d, Gf.Matrix4d(rows))
        order = Vt.TokenArray(["xformOp:transform"])
        set_value(layer, path, "xformOpOrder", kind.TokenArray, order, is_uniform=True)
        yield f"{name}: moved"


def _is_placed(path, state):
    """Return whether a bundle takes over the position of a prim."""
    if f"{path}/".startswith((f"{TILES}/", f"{LIGHTS}/")):
        return True
    above, _, name = path.rpartition("/")
    if above == CAMERAS:
        return name not in BUILT_CAMERAS
    added = (leaf for leaf in state["leaves"] if not leaf.startswith(f"{TILES}/"))
    return any(f"{leaf}/".startswith(f"{path}/") for leaf in added)


def _why_it_stays(path, is_field):
    if is_field:
        return "move its volume"
    is_camera = path.startswith(f"{CAMERAS}/")
    return "add a camera of your own" if is_camera else "nothing in the bundle stands there"


def _write_lights(layer, stage, state, objects):
    """Write the edits of the stage's lights, and yield one line for each."""
    for path, before in state["lights"].items():
        block = objects.get(path)
        name = path.rpartition("/")[2]
        if _is_hidden(block):
            _hide(layer, path)
            yield f"{name}: hidden"
            continue
        now = light_values(block)
        if _differ([now[1:]], [before[1:]]):
            kind = Sdf.ValueTypeNames.Color3f
            set_value(layer, path, "inputs:color", kind, Gf.Vec3f(*now[1:]))
            yield f"{name}: colour"
        if _differ([now[:1]], [before[:1]]):
            intensity = intensity_of(stage.GetPrimAtPath(path), now[0], before[0])
            set_value(layer, path, "inputs:intensity", Sdf.ValueTypeNames.Float, intensity)
            yield f"{name}: strength"


def _write_points(layer, stage, state, objects, lost):
    """Write the meshes whose points moved, and yield one line for each.

    The points are those of the level of detail that was imported.
    """
    for path in state["leaves"]:
        block, before = objects.get(path), state["snapshots"][path]
        if block is None or block.type != "MESH":
            continue
        now = take_snapshot(block)
        if now["points"] == before["points"] or now["faces"] != before["faces"]:
            continue  # `snapshot.find_losses` reports changed faces
        if not path.startswith(f"{TILES}/"):
            lost.append(
                f"the shape of {before['name']} is not taken over: an earlier layer added it: hide "
                "it, and edit a copy"
            )
            continue
        tile = path.removeprefix(f"{TILES}/").partition("/")[0]
        lod = state["lods"].get(tile, "")
        mesh = UsdGeom.Mesh(_as_staged(stage, f"{TILES}/{tile}", lod, path) or Usd.Prim())
        points = points_of_mesh(block.data)
        if not mesh or len(mesh.GetPointsAttr().Get() or []) != len(points):
            lost.append(
                f"the shape of {before['name']} is not taken over: the stage has other points now"
            )
            continue
        if lod:
            Sdf.CreateVariantInLayer(layer, f"{TILES}/{tile}", "lod", lod)
        _write_shape(layer, _place_of(f"{TILES}/{tile}", lod, path), mesh, points)
        at = f" at {lod}" if lod else ""
        finer = "; finer levels keep their shape (import lod0 to edit them)"
        yield f"{before['name']}: points{at}" + (finer if lod not in ("", "lod0") else "")


def _write_objects(layer, stage, root, objects):
    """Write the edits of the objects of label maps, and yield one line for each."""
    kind = Sdf.ValueTypeNames
    for channel, edits in kept(root).items():
        path = f"{CHANNELS}/{channel}"
        prim = stage.GetPrimAtPath(path)
        default = edits.get("default")
        if default is not None and default != prim.GetAttribute("stereocell:defaultColumn").Get():
            set_value(layer, path, "stereocell:defaultColumn", kind.Token, default)
            yield f"{channel}: coloured by {default or 'the objects alone'}"
        if hidden := edits.get("hidden"):
            labels = Vt.UInt64Array([int(label) for label in hidden])
            set_value(layer, path, "stereocell:hiddenObjects", kind.UInt64Array, labels)
            yield f"{channel}: {len(hidden)} objects hidden"
        for column, names in edits.get("classes", {}).items():
            name = f"stereocell:column:{column}"
            set_value(layer, path, name, kind.String, prim.GetAttribute(name).Get())
            spec = layer.GetAttributeAtPath(f"{path}.{name}")
            spec.customData = {"categories": Vt.StringArray(names)}
            yield f"{channel}: names of {column}"
        yield from _write_colors(layer, stage, channel, edits.get("colors", {}), objects)


def _write_colors(layer, stage, channel, colors, objects):
    """Write the colours of single objects into each mesh, and yield one line for each mesh.

    The colours hold at all levels of detail.
    """
    for path, block in objects.items():
        if block.get(CHANNEL) != channel:
            continue
        labels = json.loads(block[LABELS])
        own = {place: colors[label] for place, label in enumerate(labels) if label in colors}
        if not own:
            continue
        tile = path.removeprefix(f"{TILES}/").partition("/")[0]
        stage.GetPrimAtPath(f"{TILES}/{tile}").Load()
        name = "primvars:displayColor"
        values = np.array(stage.GetPrimAtPath(path).GetAttribute(name).Get(), np.float32)
        if len(values) != len(labels):
            continue  # the stage's mesh has other objects now than at the import
        for place, color in own.items():
            values[place] = color
        array = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values))
        set_value(layer, path, name, Sdf.ValueTypeNames.Color3fArray, array)
        yield f"{block.name}: colours of {len(own)} objects"


def _write_hints(layer, stage, state, root, objects):
    """Widen each tile's extents hint, its box while unloaded, to hold moved meshes and volumes."""
    for tile, lod in state["lods"].items():
        path = f"{TILES}/{tile}"
        hint = UsdGeom.ModelAPI(stage.GetPrimAtPath(path)).GetExtentsHintAttr().Get()
        if not hint:
            continue
        boxes = [np.array(hint[:2], np.float64)]
        for leaf in state["leaves"]:
            if not leaf.startswith(f"{path}/") or leaf not in objects:
                continue
            chain = [leaf]
            while chain[-1].rpartition("/")[0] != path:
                chain.append(chain[-1].rpartition("/")[0])
            shape = layer.GetAttributeAtPath(f"{_place_of(path, lod, leaf)}.extent")
            places = [layer.GetAttributeAtPath(f"{one}.xformOp:transform") for one in chain]
            if shape is None and not any(places):
                continue
            matrix = np.eye(4)
            for one in chain:
                if one in objects:
                    matrix = np.array(matrix_of(one, {ROOT: root, **objects})) @ matrix
            extents = _extents(stage, path, leaf) if any(places) else []
            for extent in [*extents, *([shape.default] if shape else [])]:
                corners = np.stack(np.meshgrid(*np.array(extent, np.float64).T), axis=-1)
                corners = corners.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
                boxes.append(np.array([corners.min(axis=0), corners.max(axis=0)]))
        low, high = np.array(boxes)[:, 0].min(axis=0), np.array(boxes)[:, 1].max(axis=0)
        if len(boxes) > 1 and not np.allclose([low, high], boxes[0], atol=0):
            box = Vt.Vec3fArray.FromNumpy(np.array([low, high], np.float32))
            set_value(layer, path, "extentsHint", Sdf.ValueTypeNames.Float3Array, box)


def _widen_root(layer, stage):
    """Widen the specimen's extents hint to hold moved tiles and added objects."""
    root = stage.GetPrimAtPath(ROOT)
    hint = UsdGeom.ModelAPI(root).GetExtentsHint()
    if not hint:
        return
    edits = Sdf.Layer.CreateAnonymous(".usda")
    edits.TransferContent(layer)
    edits.subLayerPaths = []
    session = stage.GetSessionLayer()
    session.subLayerPaths = [*session.subLayerPaths, edits.identifier]
    try:
        purposes = [UsdGeom.Tokens.default_, UsdGeom.Tokens.render]
        boxes = UsdGeom.BBoxCache(Usd.TimeCode.Default(), purposes, True)
        box = Gf.Range3d(Gf.Vec3d(*hint[0]), Gf.Vec3d(*hint[1]))
        for child in root.GetChildren():
            box.UnionWith(boxes.ComputeRelativeBound(child, root).ComputeAlignedRange())
    finally:
        session.subLayerPaths = [path for path in session.subLayerPaths if path != edits.identifier]
    corners = np.array([list(box.GetMin()), list(box.GetMax())])
    if not np.allclose(corners, np.array(hint[:2]), atol=0):
        array = Vt.Vec3fArray.FromNumpy(corners.astype(np.float32))
        set_value(layer, ROOT, "extentsHint", Sdf.ValueTypeNames.Float3Array, array)


def _extents(stage, tile, path):
    """Return a prim's extents in all levels of detail that the stage has."""
    prim = stage.GetPrimAtPath(tile)
    prim.Load()
    levels = prim.GetVariantSet("lod").GetVariantNames() or [""]
    prims = (_as_staged(stage, tile, level, path) for level in levels)
    extents = (prim.GetAttribute("extent").Get() for prim in prims if prim)
    return [extent for extent in extents if extent]


def _as_staged(stage, tile, lod, path):
    """Return a prim of the stage in a level of detail; None if it isn't there any more."""
    prim = stage.GetPrimAtPath(tile)
    if not prim:
        return None
    prim.Load()
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        for name, variant in (("lod", lod), ("representation", "both")):
            if variant in prim.GetVariantSet(name).GetVariantNames():
                prim.GetVariantSet(name).SetVariantSelection(variant)
    return stage.GetPrimAtPath(path) or None


def _place_of(tile, lod, path):
    """Return the path in a layer for edits of a mesh in one level of detail.

    The path lies in the level's variant, since other levels have other points. A flattened stage
    has one level and no variants; its `lod` is empty.
    """
    return f"{tile}{{lod={lod}}}{path.removeprefix(f'{tile}/')}" if lod else path


def _write_shape(layer, place, mesh, points):
    """Write a mesh's points, and the extent, normals and tangents that follow from them."""
    kind = Sdf.ValueTypeNames
    before = np.array(mesh.GetPointsAttr().Get(), np.float32)
    array = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points))
    set_value(layer, place, "points", kind.Point3fArray, array)
    extent = UsdGeom.PointBased.ComputeExtent(array)
    set_value(layer, place, "extent", kind.Float3Array, extent)
    counts, indices = (
        np.array(attribute.Get() or [], np.int64)
        for attribute in (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
    )
    triangles = cut_fans(counts, indices)
    prim = mesh.GetPrim()
    primvar = prim.GetAttribute("primvars:normals").Get()
    normals = mesh.GetNormalsAttr().Get() if primvar is None else primvar
    normals = np.array([] if normals is None else normals, np.float32)
    is_known = normals.shape == points.shape  # the pipeline writes one normal for each vertex
    groups = group_seams(before, points, normals if is_known else points)
    if is_known:
        turned = turn_with(normals, before, points, triangles, groups)
        name = "normals" if primvar is None else "primvars:normals"
        set_value(layer, place, name, kind.Normal3fArray, Vt.Vec3fArray.FromNumpy(turned))
    tangents = np.array(prim.GetAttribute("primvars:tangents").Get() or [], np.float32)
    corners = np.array(prim.GetAttribute("primvars:tangents:indices").Get() or [], np.int64)
    if tangents.ndim == 2 and len(corners) == len(indices):
        # Each value belongs to one point; a point on a seam of UVs has several.
        point_of = np.zeros(len(tangents), np.int64)
        point_of[corners] = indices
        around = cut_fans(counts, corners)
    else:
        point_of, around = np.arange(len(points)), triangles
    if tangents.shape == (len(point_of), 4):
        turned = turn_with(
            tangents[:, :3], before[point_of], points[point_of], around, groups[point_of]
        )
        turned = np.ascontiguousarray(np.concatenate([turned, tangents[:, 3:]], axis=1))
        array = Vt.Vec4fArray.FromNumpy(turned)
        set_value(layer, place, "primvars:tangents", kind.Float4Array, array)


def _differ(rows, others, tolerance=1e-5):
    """Return whether two tables differ by more than `tolerance`, relative to the largest number.

    The largest number of `others` counts, or 1 if that is larger.
    """
    if len(rows) != len(others):
        return True
    pairs = [
        pair
        for row, other in zip(rows, others, strict=True)
        for pair in zip(row, other, strict=True)
    ]
    largest = max([1.0, *(abs(value) for _, value in pairs)])
    return any(abs(a - b) > tolerance * largest for a, b in pairs)
