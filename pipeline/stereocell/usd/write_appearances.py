"""Write looks/channels.usda, which has the appearances of all channels.

Each channel is a material below /Specimen/Channels that the materials of all tiles inherit. The
channel's colour is the material's `inputs:color`, which volume renderers and the bundle read. The
shader `surface` repeats the colour as a plain value, because Blender's importer and small viewers
do not follow connections to the material. Storm draws the shader `surface_live`, which does have
such a connection, so an edit of `inputs:color` shows at once. If both colours were edited, the
bundle uses `inputs:color`, see usd/read_appearances.py.

The opacity points are the transfer function, and the LUT is computed from them. A variant with
shapes is a 2D function. Its opacity points are used where gradients are not known.

The material has no volume output, since USD defines no volume shader that renderers share. A
Volume prim is bound to its material so that programs find the channel's values (colour, opacity
points, LUT). The binding alone does NOT make a renderer draw the volume. An artist has to connect
`outputs:volume` to the renderer's own shader, in a layer over the stage, and `inputs:color` to the
shader's colour. There is an example of this layer in docs/stage-volumes.md. The page also lists the
shaders that were tried: USD's validators refuse all that renderers know. The bundle's viewer has
its own ray caster.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt

from stereocell.filters.reach import HOT_VOXEL_REACH, SMOOTHING_REACH
from stereocell.formats.exr import write_lut
from stereocell.model.channel import Appearance, OpacityPoints, Shapes, SurfaceLevel
from stereocell.model.object_table import ObjectTable
from stereocell.storage.json_files import write_json
from stereocell.usd.layer import (
    BUILT_COLOR,
    CHANNEL_API,
    CHANNELS,
    PAINTED_BY,
    ROOT,
    SHOWN,
    export,
    new_stage,
    set_attribute,
)
from stereocell.usd.numbers2d import write_numbers
from stereocell.usd.preview_surface import define_surface
from stereocell.usd.write_objects import write_columns

_STORM = "glslfx"  # Storm's name among the render contexts of materials

_Types = Sdf.ValueTypeNames


def write_appearances(
    folder: Path, appearances: Sequence[Appearance], tables: Mapping[str, ObjectTable]
) -> None:
    """Write channels.usda, <channel>_<function>.exr and <channel>_level.json into `folder`.

    tables  object tables of label maps, by channel ID

    Raises OutputError.
    """
    stage = new_stage(".usda", ROOT.name)
    stage.OverridePrim(ROOT)
    UsdGeom.Scope.Define(stage, CHANNELS)
    UsdGeom.Scope.Define(stage, SHOWN)
    for appearance in appearances:
        shown = UsdGeom.Scope.Define(stage, SHOWN.AppendChild(appearance.id))
        shown.GetPrim().SetDisplayName(appearance.name)
        visibility = shown.CreateVisibilityAttr(UsdGeom.Tokens.inherited)
        if not appearance.opens:
            visibility.Set(UsdGeom.Tokens.invisible)
        material = UsdShade.Material.Define(stage, CHANNELS.AppendChild(appearance.id))
        _author_appearance(material, appearance)
        is_fed = bool(appearance.painted_by) or appearance.id in tables
        _author_surface(material, is_fed)
        if appearance.id in tables:
            write_columns(material.GetPrim(), tables[appearance.id])
        _author_functions(material.GetPrim(), appearance)
        if appearance.level is not None:
            write_json(folder / _level_name(appearance), level_to_json(appearance.level))
        for name, points in appearance.transfer_functions.items():
            write_lut(folder / _lut_name(appearance, name), points)
    export(stage.GetRootLayer(), folder / "channels.usda")


def _lut_name(appearance: Appearance, function: str) -> str:
    return f"{appearance.id}_{function}.exr"


def _level_name(appearance: Appearance) -> str:
    return f"{appearance.id}_level.json"


def level_to_json(level: SurfaceLevel) -> dict[str, Any]:
    """Return the parameters with which the surface can be extracted again from the source."""
    return {
        "format": "stereocell-level",
        "version": 1,
        "about": "The surface lies where the denoised voxels equal background + iso. Arrays have "
        "the axes z, y, x. Positions of knots are in voxels of the resolution level that was "
        "built. Between knots, values are linear. Each voxel is first clipped to the least and "
        "largest of its neighbours in hot_voxel_box, without the two straight across the plane of "
        "median_voxels. Median and Gaussian then change it by at most max_shift (null: no limit).",
        "iso": level.iso,
        "iso_by_tile": None if level.by_tile is None else level.by_tile.to_json(),
        "background": None if level.background is None else level.background.to_json(),
        "denoising": {
            "median_voxels": list(level.median_size),
            "gaussian_sigma_um": level.smoothing_um,
            "gaussian_truncate": SMOOTHING_REACH,
            "max_shift": level.max_shift,
            "hot_voxel_box": [2 * HOT_VOXEL_REACH * (max(level.median_size) > 1) + 1] * 3,
        },
    }


def _author_level(prim: Usd.Prim, level: SurfaceLevel, name: str) -> None:
    set_attribute(prim, "stereocell:levelIso", _Types.Float, level.iso)
    set_attribute(prim, "stereocell:levelSmoothing", _Types.Float, level.smoothing_um)
    set_attribute(prim, "stereocell:levelFile", _Types.String, f"./{name}")
    if level.background_range is not None:
        span = Gf.Vec2f(*level.background_range)
        set_attribute(prim, "stereocell:levelBackground", _Types.Float2, span)


def _author_appearance(material: UsdShade.Material, appearance: Appearance) -> None:
    prim = material.GetPrim()
    prim.SetDisplayName(appearance.name)
    prim.AddAppliedSchema(CHANNEL_API)
    material.CreateInput("color", _Types.Color3f).Set(Gf.Vec3f(*appearance.color))
    for name in ("window", "volumeWindow"):
        set_attribute(prim, f"stereocell:{name}", _Types.Float2, Gf.Vec2f(*appearance.window))
    set_attribute(prim, "stereocell:isoConfidence", _Types.Float, appearance.iso_confidence)
    set_attribute(prim, "stereocell:surfaceVerdict", _Types.Token, appearance.surface)
    if appearance.surface_reason:
        reason = appearance.surface_reason
        set_attribute(prim, "stereocell:surfaceReason", _Types.String, reason)
    if appearance.level is not None:
        _author_level(prim, appearance.level, _level_name(appearance))
    write_numbers(prim, appearance.transfer_2d)
    if appearance.painted_by:
        set_attribute(prim, PAINTED_BY, _Types.String, appearance.painted_by, custom=True)
    if appearance.iso_value is not None:
        set_attribute(prim, "stereocell:isoValue", _Types.Float, appearance.iso_value)
    if appearance.threshold is not None:
        set_attribute(prim, "stereocell:threshold", _Types.Float, appearance.threshold)


def _author_surface(material: UsdShade.Material, is_fed: bool) -> None:
    # No colour is written if the tiles' maps or primvars feed it: it would be stronger than them.
    color = None if is_fed else material.GetInput("color").Get()
    surface = define_surface(material, color)
    if color is not None:
        surface.GetInput("diffuseColor").GetAttr().SetCustomDataByKey(BUILT_COLOR, color)
        _author_live_surface(material, surface)


def _author_live_surface(material: UsdShade.Material, surface: UsdShade.Shader) -> None:
    """Write the shader that Storm draws: `surface` with a connection to the material's colour.

    It inherits from `surface`, so it also has the maps that a tile connects to `surface`.
    """
    stage, path = material.GetPrim().GetStage(), material.GetPath().AppendChild("surface_live")
    live = UsdShade.Shader.Define(stage, path)
    live.GetPrim().GetInherits().AddInherit(surface.GetPath())
    color = live.CreateInput("diffuseColor", _Types.Color3f)
    color.ConnectToSource(material.GetInput("color"))
    output = live.CreateOutput("surface", _Types.Token)
    material.CreateSurfaceOutput(_STORM).ConnectToSource(output)


def _author_functions(prim: Usd.Prim, appearance: Appearance) -> None:
    variants = prim.GetVariantSets().AddVariantSet("transferFunction")
    for name, points in appearance.transfer_functions.items():
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            pairs = _pairs(points)
            set_attribute(prim, "stereocell:opacityPoints", _Types.Float2Array, pairs)
            set_attribute(prim, "stereocell:lut", _Types.Asset, f"./{_lut_name(appearance, name)}")
            if name in appearance.transfer_2d.functions:
                _author_shapes(prim, appearance.transfer_2d.functions[name])
    variants.SetVariantSelection(appearance.function)


def _author_shapes(prim: Usd.Prim, shapes: Shapes) -> None:
    """Write a 2D function as arrays with one entry per shape, see docs/transfer-functions.md."""
    boxes = [Gf.Vec4f(*shape.values, *shape.gradients) for shape in shapes]
    colors = [Gf.Vec4f(*shape.color, shape.opacity) for shape in shapes]
    for name, kind, values in (
        ("shapeKinds", _Types.TokenArray, Vt.TokenArray([shape.kind for shape in shapes])),
        ("shapes", _Types.Float4Array, Vt.Vec4fArray(boxes)),
        ("shapeTips", _Types.FloatArray, Vt.FloatArray([shape.tip for shape in shapes])),
        ("shapeColors", _Types.Color4fArray, Vt.Vec4fArray(colors)),
        ("shapeSoftness", _Types.FloatArray, Vt.FloatArray([s.softness for s in shapes])),
    ):
        set_attribute(prim, f"stereocell:{name}", kind, values)


def _pairs(points: OpacityPoints) -> Vt.Vec2fArray:
    return Vt.Vec2fArray([Gf.Vec2f(*point) for point in points])
