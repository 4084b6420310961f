"""Copy the lights of a composed stage into a specimen.usdz.

A usdz is scaled, so only lights without a position keep their effect: distant lights and domes.
Images in formats that usdz does not allow are left out.

References: OpenUSD, Usdz File Format Specification, https://openusd.org/release/spec_usdz.html
"""

from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from stereocell.usd.layer import LIGHTS
from stereocell.usd.read_attributes import file_of
from stereocell.usd.typed_values import read_as

_IMAGES = (".exr", ".png", ".jpg", ".jpeg")


def copy_lights(composed: Usd.Stage, small: Usd.Stage) -> dict[str, Path]:
    """Define the visible lights of a composed stage in the stage of a usdz.

    Returns the images of the lights by their names in the archive.
    """
    group = composed.GetPrimAtPath(LIGHTS)
    images: dict[str, Path] = {}
    for light in group.GetChildren() if group else ():
        is_distant = light.IsA(UsdLux.DistantLight) or light.IsA(UsdLux.DomeLight)
        visibility = UsdGeom.Imageable(light).ComputeVisibility()
        if is_distant and visibility != UsdGeom.Tokens.invisible:
            images |= _copy_light(light, small)
    return images


def _copy_light(light: Usd.Prim, small: Usd.Stage) -> dict[str, Path]:
    UsdGeom.Scope.Define(small, LIGHTS)
    copy = small.DefinePrim(LIGHTS.AppendChild(light.GetName()), light.GetTypeName())
    world = UsdGeom.XformCache().GetLocalToWorldTransform(light)
    turn = Gf.Matrix4d(world.ExtractRotationMatrix().GetOrthonormalized(), Gf.Vec3d(0))
    if turn != Gf.Matrix4d(1):
        UsdGeom.Xformable(copy).AddTransformOp().Set(turn)
    images = {}
    for attribute in light.GetAuthoredPropertiesInNamespace("inputs"):
        kind = _type_of(light, attribute)
        value = read_as(attribute, kind)
        if isinstance(value, Sdf.AssetPath):
            if not value.path or Path(value.path).suffix.lower() not in _IMAGES:
                continue
            file = file_of(attribute)
            name = f"textures/{light.GetName()}{file.suffix}"
            images[name] = file
            value = Sdf.AssetPath(name)
        if value is not None:
            copy.CreateAttribute(attribute.GetName(), kind, False).Set(value)
    return images


def _type_of(light: Usd.Prim, attribute: Usd.Attribute) -> Sdf.ValueTypeName:
    """Return the type that a light's schema has for an attribute, or the attribute's own."""
    known = light.GetPrimDefinition().GetAttributeDefinition(attribute.GetName())
    return known.GetTypeName() if known else attribute.GetTypeName()
