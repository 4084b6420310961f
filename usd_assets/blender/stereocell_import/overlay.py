"""Write what an artist changed as a layer over the stage: `stereocell bundle OUT --stage LAYER`.

Colours (in a channel's colour group), opacities (in a volume material's ramp), objects hidden or
deleted, tiles moved, and variants chosen at the import. Where the whole specimen stands in the
scene is the scene's own affair.
"""

import json
import os
from pathlib import Path

import bpy
from pxr import Gf, Sdf, Vt

from .choice import CHANNELS, METERS_PER_UNIT, ROOT, TILES, open_stage
from .importing import COLOR, PRIM, STATE, VOLUME, matrix_in
from .looks import color_of, points_of
from .problem import StageProblem

_MOVED = 1e-4  # of the longest translation and of 1: floats of 32 bits, through a scale of 1e-6


def export_edits(context, path):
    """Write the layer; return a line for each edit in it. Raises StageProblem."""
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
    Sdf.CreatePrimInLayer(layer, ROOT)  # the default prim, also where nothing was edited
    objects = {}
    for block in context.scene.objects:
        if PRIM in block and _is_below(root, block):
            objects.setdefault(block[PRIM], []).append(block)
    edits = [
        *_write_looks(layer, stage, root, state),
        *_write_variants(layer, state),
        *_write_hidden(layer, state, objects),
        *_write_moved(layer, state, root, objects),
    ]
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        if not layer.Export(str(temporary)):
            raise StageProblem(f"{path}: can't be written")
        temporary.replace(path)
    except OSError as error:
        raise StageProblem(f"{path}: can't be written: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)
    return edits


def _find_root(context):
    """Return the specimen above the active object, or the only one."""
    block = context.view_layer.objects.active
    while block is not None and STATE not in block:
        block = block.parent
    if block is not None:
        return block
    found = [block for block in context.scene.objects if STATE in block]
    if len(found) != 1:
        raise StageProblem(f"{len(found)} imported stages in the scene, expected one selected")
    return found[0]


def _is_below(root, block):
    while block is not None and block != root:
        block = block.parent
    return block == root


def _name_of(stage, layer):
    """Return how a layer names its stage: relative, so that both can be moved together."""
    try:
        relative = os.path.relpath(stage.resolve(), layer.resolve().parent)
    except ValueError:  # on another drive
        return stage.as_posix()
    name = Path(relative).as_posix()
    return name if name.startswith("..") else f"./{name}"


def _write_looks(layer, stage, root, state):
    for channel, look in state["channels"].items():
        path = f"{CHANNELS}/{channel}"
        group, material = root.get(COLOR + channel), root.get(VOLUME + channel)
        color = look["color"] if group is None else color_of(group)
        if _differ([color], [look["color"]]):
            _set(layer, path, "inputs:color", Sdf.ValueTypeNames.Color3f, Gf.Vec3f(*color))
            yield f"{channel}: colour"
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
            if look["function"]:  # in its variant: the other functions stay as they are
                variant = Sdf.CreateVariantInLayer(
                    layer, path, "transferFunction", look["function"]
                )
                place = variant.primSpec.path
            kind = Sdf.ValueTypeNames.Float2Array
            _set(layer, place, "stereocell:opacityPoints", kind, pairs)
            yield f"{channel}: opacities"


def _write_variants(layer, state):
    for tile, chosen in state["chosen"].items():
        for name, variant in sorted(chosen.items()):
            over = Sdf.CreatePrimInLayer(layer, f"{TILES}/{tile}")
            over.variantSelections[name] = variant
            yield f"{tile}: {name} {variant}"


def _write_hidden(layer, state, objects):
    hidden = [path for path in state["leaves"] if all(map(_is_hidden, objects.get(path, [])))]
    for tile in state["chosen"]:
        path = f"{TILES}/{tile}"
        inside = [leaf for leaf in state["leaves"] if leaf.startswith(f"{path}/")]
        if all(map(_is_hidden, objects.get(path, []))) or (inside and set(inside) <= set(hidden)):
            _hide(layer, path)
            yield f"{tile}: hidden"
            continue
        for leaf in inside:
            if leaf in hidden:
                _hide(layer, leaf)
                yield f"{leaf.rsplit('/', 1)[1]}: hidden"


def _is_hidden(block):
    return block.hide_render or not block.visible_get()


def _hide(layer, path):
    _set(layer, path, "visibility", Sdf.ValueTypeNames.Token, "invisible")


def _write_moved(layer, state, root, objects):
    frame = objects.get(TILES, [root])[0]
    for tile, before in state["matrices"].items():
        path = f"{TILES}/{tile}"
        for block in objects.get(path, [])[:1]:
            matrix = matrix_in(frame, block)
            if not _differ(matrix, before, _MOVED):
                continue
            rows = [[round(float(v), 6) for v in row] for row in zip(*matrix, strict=True)]
            kind = Sdf.ValueTypeNames
            _set(layer, path, "xformOp:transform", kind.Matrix4d, Gf.Matrix4d(rows))
            order = Vt.TokenArray(["xformOp:transform"])
            _set(layer, path, "xformOpOrder", kind.TokenArray, order, is_uniform=True)
            yield f"{tile}: moved"


def _set(layer, path, name, kind, value, is_uniform=False):
    prim = layer.GetPrimAtPath(path) or Sdf.CreatePrimInLayer(layer, path)
    variability = Sdf.VariabilityUniform if is_uniform else Sdf.VariabilityVarying
    Sdf.AttributeSpec(prim, name, kind, variability).default = value


def _differ(rows, others, tolerance=1e-5):
    """Tell whether two tables of numbers differ by more than a share of their largest, or of 1."""
    if len(rows) != len(others):
        return True
    pairs = [
        pair
        for row, other in zip(rows, others, strict=True)
        for pair in zip(row, other, strict=True)
    ]
    largest = max([1.0, *(abs(value) for _, value in pairs)])
    return any(abs(a - b) > tolerance * largest for a, b in pairs)
