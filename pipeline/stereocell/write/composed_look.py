"""Read the looks of a composed stage: the channels', and what a tile's own mesh is drawn with."""

import itertools
from dataclasses import dataclass
from pathlib import Path

from pxr import Usd, UsdShade

from stereocell.errors import StageError
from stereocell.specimen import OpacityPoints
from stereocell.write.composed_values import (
    color_of,
    file_of,
    select_variant,
    shortest,
    value_of,
)
from stereocell.write.gltf import Material
from stereocell.write.usd_layer import CHANNELS
from stereocell.write.usd_looks import DEFAULT_FUNCTION


@dataclass(frozen=True, slots=True)
class ComposedLook:
    """One channel as the stage draws it; see specimen.Look. `chosen`: a transfer function."""

    id: str
    name: str
    color: tuple[float, float, float]
    window: tuple[float, float]
    iso_value: float | None
    iso_normalized: float | None
    chosen: str
    transfer_functions: dict[str, OpacityPoints]


def read_looks(stage: Usd.Stage) -> list[ComposedLook]:
    """Return the channels' looks, in the stage's order. Raises StageError for a faulty one."""
    prims = stage.GetPrimAtPath(CHANNELS).GetChildren()
    return [_read_look(prim) for prim in prims if prim.IsA(UsdShade.Material)]


def surface_of(prim: Usd.Prim) -> UsdShade.Shader:
    """Return the UsdPreviewSurface that a mesh is drawn with. Raises StageError."""
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    if not material:
        raise StageError(f"{prim.GetPath()}: no material bound")
    surface, _, _ = material.ComputeSurfaceSource()
    if not surface or surface.GetShaderId() != "UsdPreviewSurface":
        raise StageError(f"{material.GetPath()}: no UsdPreviewSurface as its surface")
    return surface


def material_of(surface: UsdShade.Shader) -> Material:
    """Return what glTF takes over of a UsdPreviewSurface. Raises StageError."""
    diffuse = _source(surface, "diffuseColor")
    if diffuse is None:
        raise StageError(f"{surface.GetPath()}.inputs:diffuseColor: no value")
    # defaults: the specification of UsdPreviewSurface
    return Material(
        color_of(diffuse), _share(surface, "metallic", 0.0), _share(surface, "roughness", 0.5)
    )


def normal_map_of(surface: UsdShade.Shader) -> Path | None:
    """Return the image that feeds a surface's normals. Raises StageError if it is missing."""
    normal = surface.GetInput("normal")
    attributes = normal.GetValueProducingAttributes() if normal else []
    if not attributes or not UsdShade.Output.IsOutput(attributes[0]):
        return None
    texture = UsdShade.Shader(attributes[0].GetPrim())
    if texture.GetShaderId() != "UsdUVTexture":
        raise StageError(f"{texture.GetPath()}: expected a UsdUVTexture to feed inputs:normal")
    return file_of(texture.GetPrim().GetAttribute("inputs:file"))


def _read_look(prim: Usd.Prim) -> ComposedLook:
    variants = prim.GetVariantSet("transferFunction")
    chosen = variants.GetVariantSelection() or DEFAULT_FUNCTION
    names = sorted(variants.GetVariantNames(), key=lambda name: (name != DEFAULT_FUNCTION, name))
    functions = {}
    for name in names:
        select_variant(prim, "transferFunction", name)
        functions[name] = _opacity_points(prim)
    if not names:  # a flattened stage has what was chosen, and no variants
        functions[chosen] = _opacity_points(prim)
    if chosen not in functions:
        raise StageError(f"{prim.GetPath()}: no transferFunction variant {chosen!r}")
    low, high = value_of(prim, "stereocell:window")
    return ComposedLook(
        prim.GetName(),
        value_of(prim, "stereocell:displayName") or prim.GetName(),
        color_of(prim.GetAttribute("inputs:color")),
        (shortest(low), shortest(high)),
        _number(prim, "stereocell:isoValue"),
        _number(prim, "stereocell:isoValueNormalized"),
        chosen,
        functions,
    )


def _number(prim: Usd.Prim, name: str) -> float | None:
    value = prim.GetAttribute(name).Get()
    return None if value is None else shortest(value)


def _opacity_points(prim: Usd.Prim) -> OpacityPoints:
    points = tuple((x, y) for x, y in value_of(prim, "stereocell:opacityPoints"))
    field = f"{prim.GetPath()}.stereocell:opacityPoints"
    if not points:
        raise StageError(f"{field}: empty, expected pairs of intensity and opacity")
    if not all(0 <= number <= 1 for point in points for number in point):
        raise StageError(f"{field}: a number outside 0..1")
    if any(after[0] < before[0] for before, after in itertools.pairwise(points)):
        raise StageError(f"{field}: intensities fall, expected them to rise")
    return points


def _share(surface: UsdShade.Shader, name: str, default: float) -> float:
    source = _source(surface, name)
    value = None if source is None else source.Get()
    return default if value is None else min(max(shortest(value), 0.0), 1.0)


def _source(surface: UsdShade.Shader, name: str) -> Usd.Attribute | None:
    """Return the attribute that gives a shader's input its value, through connections."""
    shader_input = surface.GetInput(name)
    attributes = shader_input.GetValueProducingAttributes() if shader_input else []
    if not attributes:
        return None
    if UsdShade.Output.IsOutput(attributes[0]):
        raise StageError(
            f"{surface.GetPath()}.inputs:{name}: comes from {attributes[0].GetPath()}, "
            "expected a plain value"
        )
    return attributes[0]
