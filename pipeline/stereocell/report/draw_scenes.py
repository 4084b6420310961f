"""Draw the meshes of units as WebP pictures."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from stereocell.preview.draw_slices import encode
from stereocell.steps.unit_files import load_surface
from stereocell.textures.draw_meshes import Box, Shape, draw_pixels


@dataclass(frozen=True, slots=True)
class Surface:
    """A mesh file (.npz) that `save_unit` wrote, and its colour, linear RGB 0..1."""

    file: str
    color: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Scene:
    """The content of one picture. A box is its smallest and largest corner (x, y, z), world um.

    boxes  boxes that are drawn as outlines, such as those of tiles
    frame  box whose projection fills the picture
    size   width and largest height of the picture, pixels
    """

    surfaces: tuple[Surface, ...]
    boxes: tuple[Box, ...]
    frame: Box
    size: tuple[int, int]

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files of the surfaces."""
        return tuple(Path(surface.file) for surface in self.surfaces)


@dataclass(frozen=True, slots=True)
class Picture:
    """A WebP file with its size in pixels."""

    data: bytes
    width: int
    height: int


def draw_scene(scene: Scene) -> Picture:
    """Draw a scene of meshes and boxes; return the picture. Raises OutputError."""
    shapes = map(_load, scene.surfaces)
    image = Image.fromarray(draw_pixels(shapes, scene.frame, scene.size, boxes=scene.boxes))
    return Picture(encode(image), *image.size)


def draw_image(
    shapes: Iterable[Shape], frame: Box, size: tuple[int, int], *, turned_deg: float = 0.0
) -> Image.Image:
    """Return a picture of meshes; see `draw_pixels`."""
    return Image.fromarray(draw_pixels(shapes, frame, size, turned_deg=turned_deg))


def _load(surface: Surface) -> Shape:
    return Shape(*load_surface(Path(surface.file)), np.array(surface.color))
