"""Read the inputs of a surface shader that are not plain values: images, and primvars."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pxr import Usd, UsdShade

from stereocell.model.errors import StageError
from stereocell.usd.read_attributes import file_of
from stereocell.usd.shader_inputs import FEEDS, Kind


@dataclass(frozen=True, slots=True)
class ComposedMaps:
    """Image files of a surface: normals (raw), ambient occlusion (raw, red), colours (sRGB)."""

    normal: Path | None = None
    occlusion: Path | None = None
    color: Path | None = None

    @property
    def files(self) -> list[Path]:
        """The image files of the maps that the surface has."""
        return [file for file in (self.normal, self.occlusion, self.color) if file is not None]

    @property
    def any(self) -> bool:
        """Whether the surface has at least one map."""
        return bool(self.files)


def maps_of(surface: UsdShade.Shader) -> ComposedMaps:
    """Return the images that feed a surface. Raises StageError if a file is missing."""
    return ComposedMaps(*(_image(surface, kind) for kind in ("normal", "occlusion", "color")))


def read_image(path: Path | NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an image, uint8 (y, x, 3), for Basis Universal, which needs edges divisible by 4.

    path  a file, which is resized if needed, or an image in memory, uint8, (y, x) or (y, x, 3),
          with edges that are divisible by 4

    Raises StageError if the file can't be read as an image.
    """
    if not isinstance(path, Path):
        return path if path.ndim == 3 else np.repeat(path[..., None], 3, axis=2)
    try:
        with Image.open(path) as file:
            image = file.convert("RGB")
    except OSError as error:
        raise StageError(f"{path}: can't be read ({error}), expected an image") from error
    width, height = (max(4, 4 * round(n / 4)) for n in image.size)
    if (width, height) != image.size:
        image = image.resize((width, height), Image.Resampling.LANCZOS)
    return np.asarray(image)


def vertex_values_of(surface: UsdShade.Shader) -> set[str]:
    """Return which of the build's primvars feed a surface: `occlusion`, `displayColor`."""
    kinds: tuple[Kind, ...] = ("occlusion", "color")
    readers = {FEEDS[kind].primvar: (feeder(surface, kind), FEEDS[kind].reader) for kind in kinds}
    return {
        primvar
        for primvar, (shader, reader) in readers.items()
        if shader is not None
        and shader.GetShaderId() == reader
        and shader.GetPrim().GetAttribute("inputs:varname").Get() == primvar
    }


def feeder(surface: UsdShade.Shader, kind: Kind) -> UsdShade.Shader | None:
    """Return the shader whose output feeds an input of the surface; None: a plain value does."""
    given = surface.GetInput(FEEDS[kind].input)
    attributes: list[Usd.Attribute] = given.GetValueProducingAttributes() if given else []
    if not attributes or not UsdShade.Output.IsOutput(attributes[0]):
        return None
    return UsdShade.Shader(attributes[0].GetPrim())


def _image(surface: UsdShade.Shader, kind: Kind) -> Path | None:
    shader = feeder(surface, kind)
    if shader is None:
        return None
    if shader.GetShaderId() == "UsdUVTexture":
        return file_of(shader.GetPrim().GetAttribute("inputs:file"))
    feed = FEEDS[kind]
    if feed.reader and shader.GetShaderId() == feed.reader:
        return None
    wanted = f"UsdUVTexture or {feed.reader}" if feed.reader else "UsdUVTexture"
    raise StageError(
        f"{shader.GetPath()}.info:id is {str(shader.GetShaderId())!r}, expected {wanted}, since it "
        f"feeds inputs:{feed.input}"
    )
