"""Copy the lights of a composed stage into a specimen.usdz.

The specimen is scaled in a usdz, so only lights without a position keep their effect: distant
lights and domes. Sphere lights, and images in formats that usdz does not allow, are left out.

Storm, USD's own renderer, can't open OpenEXR images inside an archive (USD 25.08: the dome is
black). So an OpenEXR image becomes a PNG if its largest value is at most MAX_RATIO times its mean.
Its values are divided by the largest one, and the light's intensity is multiplied by it. An image
with a larger range, such as one with the sun in it, is not converted.

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
from stereocell.usd.read_lights import visible_lights
from stereocell.usd.typed_values import read_as
from stereocell.usd.written_files import AsWritten

MAX_RATIO = 64.0  # largest value / mean, up to which 8-bit sRGB holds the mean within 4 %
_IMAGES = (".exr", ".png", ".jpg", ".jpeg")


def copy_lights(composed: Usd.Stage, small: Usd.Stage, as_written: AsWritten) -> dict[str, bytes]:
    """Copy the visible lights of a composed stage into the stage of a usdz.

    Returns the images of the lights by file name in the archive. Raises StageError for a damaged
    image.
    """
    images: dict[str, bytes] = {}
    for light in visible_lights(composed):
        if not light.IsA(UsdLux.SphereLight):
            images |= _copy_light(light, small, as_written)
    return images


def _copy_light(light: Usd.Prim, small: Usd.Stage, as_written: AsWritten) -> dict[str, bytes]:
    UsdGeom.Scope.Define(small, LIGHTS)
    path, number = LIGHTS.AppendChild(light.GetName()), 1
    while small.GetPrimAtPath(path):  # another group of the stage has a light of this name
        number += 1
        path = LIGHTS.AppendChild(f"{light.GetName()}_{number}")
    copy = small.DefinePrim(path, light.GetTypeName())
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
            name = f"textures/{path.name}{suffix}"
            images[name] = content
            value = Sdf.AssetPath(name)
        if value is not None:
            copy.CreateAttribute(attribute.GetName(), kind, False).Set(value)
    if factor != 1.0:
        intensity = UsdLux.LightAPI(copy).GetIntensityAttr()
        intensity.Set(intensity.Get() * factor)
    return images


def _pack_image(file: Path) -> tuple[str, bytes, float]:
    """Return the suffix and content of a light's image, and a factor for the light's intensity.

    Raises StageError if an OpenEXR image can't be read.
    """
    if file.suffix.lower() == ".exr":
        pixels = read_rgb(file)
        largest = float(pixels.max())
        if 0 < largest <= MAX_RATIO * pixels.mean():
            return ".png", _encode_png(pixels / largest), largest
    return file.suffix, file.read_bytes(), 1.0


def _encode_png(pixels: NDArray[np.float32]) -> bytes:
    """Encode linear values from 0 to 1, (height, width, 3), as an sRGB PNG."""
    encoded = np.where(
        pixels <= 0.0031308, pixels * 12.92, 1.055 * np.maximum(pixels, 1e-9) ** (1 / 2.4) - 0.055
    )
    content = io.BytesIO()
    Image.fromarray(np.rint(encoded * 255).astype(np.uint8)).save(content, "PNG")
    return content.getvalue()


def _type_of(light: Usd.Prim, attribute: Usd.Attribute) -> Sdf.ValueTypeName:
    """Return the type of an attribute by the light's schema, or else the attribute's own type."""
    known = light.GetPrimDefinition().GetAttributeDefinition(attribute.GetName())
    return known.GetTypeName() if known else attribute.GetTypeName()
