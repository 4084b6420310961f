"""Write nvindex.usda: the stage with transfer functions for NVIDIA IndeX in Omniverse.

All names are defined by IndeX. A prim of type `Colormap` has RGBA values at points of a field's
domain. A shader connects it to the material's output `nvindex:volume`. The attribute
`nvindex:composite` makes IndeX draw a volume together with surfaces, and `omni:rtx:skip` makes RTX
leave it out. The layer's custom data switch the renderer on. Omniverse reads them only from the
layer that it opens.

This is a separate layer for two reasons. Shaders of IndeX have no `info:id`, which the validators
of stages require. Without IndeX, the volumes would not be drawn at all. NVIDIA's renderers were
not available, so the result was never seen.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdShade, Vt

from stereocell.model.channel import Appearance
from stereocell.usd.layer import CHANNELS, ROOT, TILES, export, new_stage, set_attribute
from stereocell.usd.written_files import NVINDEX_NAME, STAGE_NAME

_DOMAIN = (0.0, 1.0)  # range of values of the grid `density`
_NOTE = """The stage for NVIDIA IndeX, which draws the volumes with a colour map of each channel.
Put edits into a layer over stage.usda. The colour maps stay those of the build."""
_SETTINGS = {"rtx:index:compositeEnabled": True, "rtx:index:compositeDepthMode": 3}

_Types = Sdf.ValueTypeNames


def write_nvindex(
    stage_dir: Path, appearances: Sequence[Appearance], tile_ids: Iterable[str]
) -> None:
    """Write nvindex.usda beside stage.usda.

    appearances  appearances of the channels that have volumes

    Raises OutputError if the file can't be written.
    """
    stage = new_stage(".usda", ROOT.name)
    for appearance in appearances:
        _write_channel(stage, appearance)
    for tile in tile_ids:
        for appearance in appearances:
            branch = TILES.AppendChild(tile).AppendChild(appearance.id)
            volume = stage.OverridePrim(branch.AppendChild(f"{appearance.id}_{tile}_volume"))
            for name in ("nvindex:composite", "omni:rtx:skip"):
                set_attribute(volume, name, _Types.Bool, True, custom=True)
    layer = stage.GetRootLayer()
    layer.documentation = _NOTE
    layer.customLayerData = {"renderSettings": _SETTINGS}
    del stage  # the sublayer would not resolve for a layer in memory
    layer.subLayerPaths = [f"./{STAGE_NAME}"]
    export(layer, stage_dir / NVINDEX_NAME)


def _write_channel(stage: Usd.Stage, appearance: Appearance) -> None:
    path = CHANNELS.AppendChild(appearance.id)
    channel = stage.OverridePrim(path)
    colormap = stage.DefinePrim(path.AppendChild("Colormap"), "Colormap")
    for name, kind, value in (
        ("colormapSource", _Types.Token, "rgbaPoints"),
        ("domain", _Types.Float2, Gf.Vec2f(*_DOMAIN)),
        ("domainBoundaryMode", _Types.Token, "clampToTransparent"),
    ):
        set_attribute(colormap, name, kind, value, custom=True)
    output = colormap.CreateAttribute("outputs:colormap", _Types.Token, True)
    shader = UsdShade.Shader.Define(stage, path.AppendChild("VolumeShader"))
    shader.CreateInput("colormap", _Types.Token).GetAttr().AddConnection(output.GetPath())
    volume = shader.CreateOutput("volume", _Types.Token)
    given = channel.CreateAttribute("outputs:nvindex:volume", _Types.Token, False)
    given.AddConnection(volume.GetAttr().GetPath())
    variants = channel.GetVariantSets().AddVariantSet("transferFunction")
    for name, points in appearance.transfer_functions.items():
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            rgba = Vt.Vec4fArray([Gf.Vec4f(*appearance.color, opacity) for _, opacity in points])
            places = Vt.FloatArray([intensity for intensity, _ in points])
            set_attribute(colormap, "rgbaPoints", _Types.Float4Array, rgba, custom=True)
            set_attribute(colormap, "xPoints", _Types.FloatArray, places, custom=True)
    variants.ClearVariantSelection()
