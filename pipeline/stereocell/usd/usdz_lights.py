"""Copy the lights of a composed stage into a specimen.usdz.

A usdz is scaled, so only lights without a position keep their effect: distant lights and domes.
Images in formats that usdz does not allow are left out.

USD's own renderer, Storm, opens no OpenEXR image inside an archive (USD 25.08: the dome is black).
So an image of at most MAX_RATIO becomes a PNG, and the light's intensity is raised by as much as
the values were lowered. An image of a larger range, such as one with the sun in it, stays as it is.

References: OpenUSD, Usdz File Format Specification, https://openusd.org/release/spec_usdz.html
"""

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from stereocell.formats.exr import read_rgb
from stereocell.usd.layer import LIGHTS
from stereocell.usd.read_attributes import file_of
from stereocell.usd.specimen import specimen_of
from stereocell.usd.typed_values import read_as
from stereocell.usd.written_files import AsWritten

MAX_RATIO = 64.0  # largest value to the mean: 8 bits of sRGB then hold the mean within 4 %
_IMAGES = (".exr", ".png", ".jpg", ".jpeg")


def copy_lights(composed: Usd.Stage, small: Usd.Stage, as_written: AsWritten) -> dict[str, bytes]:
    """Define the visible lights of a composed stage in the stage of a usdz.

    Returns the images of the lights by their names in the archive. Raises StageError for a damaged
    image.
    """
    group = composed.GetPrimAtPath(specimen_of(composed).lights)
    images: dict[str, bytes] = {}
    for light in group.GetChildren() if group else ():
        is_distant = light.IsA(UsdLux.DistantLight) or light.IsA(UsdLux.DomeLight)
        visibility = UsdGeom.Imageable(light).ComputeVisibility()
        if is_distant and visibility != UsdGeom.Tokens.invisible:
            images |= _copy_light(light, small, as_written)
    return images


def _copy_light(light: Usd.Prim, small: Usd.Stage, as_written: AsWritten) -> dict[str, bytes]:
    UsdGeom.Scope.Define(small, LIGHTS)
    copy = small.DefinePrim(LIGHTS.AppendChild(light.GetName()), light.GetTypeName())
    world = UsdGeom.XformCache().GetLocalToWorldTransform(light)
    turn = Gf.Matrix4d(world.ExtractRotationMatrix().GetOrthonormalized(), Gf.Vec3d(0))
    if turn != Gf.Matrix4d(1):
        UsdGeom.Xformable(copy).AddTransformOp().Set(turn)
    images: dict[str, bytes] = {}
    factor = 1.0
    for attribute in light.GetAuthoredPropertiesInNamespace("inputs"):
        kind = _type_of(light, attribute)
        value = read_as(attribute, kind)
        if isinstance(value, Sdf.AssetPath):
            if not value.path or Path(value.path).suffix.lower() not in _IMAGES:
                continue
            suffix, content, factor = _pack_image(as_written.require(file_of(attribute)))
            name = f"textures/{light.GetName()}{suffix}"
            images[name] = content
            value = Sdf.AssetPath(name)
        if value is not None:
            copy.CreateAttribute(attribute.GetName(), kind, False).Set(value)
    if factor != 1.0:
        intensity = UsdLux.LightAPI(copy).GetIntensityAttr()
        intensity.Set(intensity.Get() * factor)
    return images


def _pack_image(file: Path) -> tuple[str, bytes, float]:
    """Return the ending and the content of a light's image, and what its intensity is times.

    Raises StageError.
    """
    if file.suffix.lower() == ".exr":
        pixels = read_rgb(file)
        largest = float(pixels.max())
        if 0 < largest <= MAX_RATIO * pixels.mean():
            return ".png", _encode_png(pixels / largest), largest
    return file.suffix, file.read_bytes(), 1.0


def _encode_png(pixels: NDArray[np.float32]) -> bytes:
    """Return linear values from 0 to 1, (height, width, 3), as a PNG, whose values are sRGB's."""
    encoded = np.where(
        pixels <= 0.0031308, pixels * 12.92, 1.055 * np.maximum(pixels, 1e-9) ** (1 / 2.4) - 0.055
    )
    content = io.BytesIO()
    Image.fromarray(np.rint(encoded * 255).astype(np.uint8)).save(content, "PNG")
    return content.getvalue()


def _type_of(light: Usd.Prim, attribute: Usd.Attribute) -> Sdf.ValueTypeName:
    """Return the type that a light's schema has for an attribute, or the attribute's own."""
    known = light.GetPrimDefinition().GetAttributeDefinition(attribute.GetName())
    return known.GetTypeName() if known else attribute.GetTypeName()
