"""Draw the meshes of units as WebP pictures."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from stereocell.preview.draw_slices import encode
from stereocell.steps.unit_files import load_lod, lod_file, record_file
from stereocell.textures.draw_meshes import Box, Shape, draw_pixels


@dataclass(frozen=True, slots=True)
class Surface:
    """One level of detail of a unit.

    unit   folder that `save_unit` wrote, absolute, because workers may run elsewhere
    level  0 is the finest
    color  linear RGB, 0..1
    """

    unit: Path
    level: int
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
        return tuple(
            file
            for one in self.surfaces
            for file in (record_file(one.unit), lod_file(one.unit, one.level))
        )


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
    mesh = load_lod(surface.unit, surface.level).mesh
    return Shape(mesh.positions, mesh.triangles, mesh.normals, np.array(surface.color))
