"""Write USD in one file: a small copy for augmented reality, or the flattened stage.

.usdz         surfaces at one level, in the size of a hand, as in the bundle (write_usdz.py)
.usdc, .usda  the composed stage without layers, payloads and variants: meshes at one level,
              volumes, materials. It refers to the volumes and maps of OUT by relative paths
"""

import os
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdUtils, Vt

from stereocell.export.chosen import Chosen
from stereocell.model.counted import counted
from stereocell.usd.layer import METERS_PER_UNIT, UP_AXIS, export, vec3f
from stereocell.usd.layer_opinions import load_payloads_of_users
from stereocell.usd.preview_surface import repeats_color
from stereocell.usd.read_appearances import edited_color
from stereocell.usd.read_attributes import select_variant
from stereocell.usd.read_variants import lod_levels
from stereocell.usd.specimen import Specimen, specimen_of
from stereocell.usd.write_usdz import SIZE_M, write_usdz


def write_light_copy(chosen: Chosen, path: Path, level: int) -> str:
    """Write a small copy for AR viewers as .usdz; return a sentence about it."""
    channels = [channel.id for channel in chosen.channels]
    tiles = chosen.tiles
    scale = chosen.options.scale
    write_usdz(
        chosen.path,
        path,
        as_written=chosen.as_written,
        level=level,
        tiles=chosen.options.tiles,
        channels=channels,
        scale=scale,
    )
    if scale is None:
        scale = SIZE_M / (chosen.longest_um * METERS_PER_UNIT)
    return f"{counted(len(tiles), 'tile')} at lod{level}; {chosen.describe_scale(scale)}"


def write_flattened(chosen: Chosen, path: Path, level: int) -> str:
    """Write .usdc or .usda; return a sentence about it. Raises OutputError."""
    stage, specimen = chosen.stage, specimen_of(chosen.stage)
    kept = {channel.id for channel in chosen.channels}
    for name in chosen.tiles:
        prim = stage.Load(specimen.tiles.AppendChild(name))
        levels = [one for one in lod_levels(prim) if one <= level]
        if levels:
            select_variant(prim, "lod", f"lod{levels[-1]}")
    load_payloads_of_users(stage)
    flat = stage.Flatten(addSourceFileComment=False)
    _state_colors(stage, flat)
    for name in chosen.all_tiles:
        if name not in chosen.tiles:
            _remove(flat, specimen.tiles.AppendChild(name))
    for place in (
        specimen.channels,
        specimen.shown,
        *map(specimen.tiles.AppendChild, chosen.tiles),
    ):
        for one in _channels(stage, place):
            if one not in kept:
                _remove(flat, place.AppendChild(one))
    stage.GetSessionLayer().Clear()
    # An artist's layer may not state these fields.
    flat.defaultPrim = specimen.top
    flat.pseudoRoot.SetInfo(UsdGeom.Tokens.metersPerUnit, METERS_PER_UNIT)
    flat.pseudoRoot.SetInfo(UsdGeom.Tokens.upAxis, UP_AXIS)
    if chosen.options.scale is not None:
        _enlarge(flat, specimen, chosen.options.scale)
    # `path` is in a temporary folder beside the file's final place.
    folder = path.parent.parent.resolve()
    UsdUtils.ModifyAssetPaths(flat, lambda asset: _relative(asset, folder))
    export(flat, path)
    tiles = counted(len(chosen.tiles), "tile")
    size = chosen.describe_scale(chosen.options.scale or 1.0)
    return f"{tiles} at lod{level}; {size}; volumes and maps stay in {chosen.path.parent}"


def _enlarge(flat: Sdf.Layer, specimen: Specimen, scale: float) -> None:
    """Enlarge the content of the specimen by transforms, and move its cameras accordingly.

    One transform above all of them would not scale the clipping ranges of the cameras.
    """
    stage = Usd.Stage.Open(flat, Usd.Stage.LoadNone)
    root = stage.GetPrimAtPath(specimen.root)
    whole = UsdGeom.ModelAPI(root)
    if hint := whole.GetExtentsHint():
        whole.SetExtentsHint(vec3f(np.array(hint) * scale))
    for prim in root.GetChildren():
        _enlarge_below(prim, scale)


def _enlarge_below(prim: Usd.Prim, scale: float) -> None:
    """Enlarge a prim if it can have a transform, or else its children."""
    if prim.IsA(UsdGeom.Camera):
        _move_camera(UsdGeom.Camera(prim), scale)
    elif prim.IsA(UsdGeom.Xformable):
        placed = UsdGeom.Xformable(prim)
        ops = placed.GetOrderedXformOps()
        enlarged = placed.AddScaleOp(UsdGeom.XformOp.PrecisionDouble, "display")
        enlarged.Set(Gf.Vec3d(scale))
        placed.SetXformOpOrder([enlarged, *ops], placed.GetResetXformStack())
        _keep_brightness(prim, scale)
    else:
        for child in prim.GetChildren():
            _enlarge_below(child, scale)


def _move_camera(camera: UsdGeom.Camera, scale: float) -> None:
    for attribute in (camera.GetFocusDistanceAttr(), camera.GetClippingRangeAttr()):
        attribute.Set(attribute.Get() * scale)
    for op in camera.GetOrderedXformOps():
        if op.GetOpType() == UsdGeom.XformOp.TypeTranslate:
            op.Set(op.Get() * scale)
        elif op.GetOpType() == UsdGeom.XformOp.TypeTransform:
            matrix = op.Get()
            op.Set(Gf.Matrix4d(matrix).SetTranslateOnly(matrix.ExtractTranslation() * scale))


def _keep_brightness(prim: Usd.Prim, scale: float) -> None:
    """Raise the intensity of sphere lights, so that they are as bright from farther away.

    Only normalized lights need this. Others grow with their radius, which is scaled, too.
    """
    for light in map(UsdLux.SphereLight, Usd.PrimRange(prim)):
        if light and light.GetNormalizeAttr().Get():
            intensity = light.GetIntensityAttr()
            intensity.Set(intensity.Get() * scale**2)


def _state_colors(stage: Usd.Stage, flat: Sdf.Layer) -> None:
    """Copy the edited colour of each material to its shader and to its meshes.

    Many programs read the colour only there.
    """
    for prim in stage.Traverse():
        edited = edited_color(prim) if prim.IsA(UsdShade.Material) else None
        if edited is not None:
            color = flat.GetAttributeAtPath(f"{prim.GetPath()}/surface.inputs:diffuseColor")
            color.default = edited.Get()
        display = UsdGeom.Mesh(prim).GetDisplayColorAttr() if prim.IsA(UsdGeom.Mesh) else None
        if display and repeats_color(display):
            material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
            edited = edited_color(material.GetPrim()) if material else None
            if edited is not None:
                flat.GetAttributeAtPath(display.GetPath()).default = Vt.Vec3fArray([edited.Get()])


def _channels(stage: Usd.Stage, place: Sdf.Path) -> list[str]:
    return [str(prim.GetName()) for prim in stage.GetPrimAtPath(place).GetAllChildren()]


def _remove(layer: Sdf.Layer, path: Sdf.Path) -> None:
    parent = layer.GetPrimAtPath(path.GetParentPath())
    if parent is not None and path.name in parent.nameChildren:
        del parent.nameChildren[path.name]


def _relative(asset: str, folder: Path) -> str:
    """Return an absolute path of an asset relative to a layer's folder; keep a relative one."""
    if not os.path.isabs(asset):
        return asset
    try:
        found = Path(os.path.relpath(asset, folder)).as_posix()
    except ValueError:  # on Windows, if the asset is on another drive
        return Path(asset).as_posix()
    return found if found.startswith("../") else f"./{found}"
