"""Draw a thumbnail of a specimen, and cards that replace it in large scenes.

previews/thumbnail.png   thumbnail for asset browsers, by the root's AssetPreviewsAPI
previews/card_xpos.png   and five other sides: cards of UsdGeomModelAPI

All images show the surfaces of `specimen.usdz`. If a scene sets the root's `model:drawMode` to
`cards`, it shows a box with the six cards instead of the specimen. The same surfaces give the same
bytes on every machine.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pxr import Sdf, Usd, UsdGeom, UsdMedia

from stereocell.model.color import linear_color
from stereocell.storage.atomic_write import replacing_folder
from stereocell.textures.draw_meshes import Box, Shape, draw_pixels, draw_side
from stereocell.usd.layer import ROOT, export
from stereocell.usd.read_levels import ComposedLod
from stereocell.usd.read_stage import hinted_box, open_stage, tile_prims
from stereocell.usd.write_usdz import find_parts
from stereocell.usd.written_files import STAGE_NAME, AsWritten

PREVIEWS = "previews"  # folder beside stage.usda
_THUMBNAIL = "thumbnail.png"
_THUMBNAIL_WIDTH = 512  # pixels
_CARD_EDGE = 512  # pixels, longer edge of a card

# Cameras at the six sides of the box: directions (x, y, z) that point right, up and to the viewer
# in an upright image. The number of counterclockwise quarter turns fits the image to USD's card.
_SIDES = {
    "XPos": ((0, 0, -1), (0, 1, 0), (1, 0, 0), 3),
    "XNeg": ((0, 0, 1), (0, 1, 0), (-1, 0, 0), 1),
    "YPos": ((-1, 0, 0), (0, 0, 1), (0, 1, 0), 0),
    "YNeg": ((1, 0, 0), (0, 0, 1), (0, -1, 0), 0),
    "ZPos": ((1, 0, 0), (0, 1, 0), (0, 0, 1), 0),
    "ZNeg": ((-1, 0, 0), (0, 1, 0), (0, 0, -1), 2),
}


@dataclass(frozen=True, slots=True)
class Preview:
    """A preview to draw.

    shapes  surfaces of the specimen
    box     box (corners x, y, z, world um) around all tiles, which cards fill
    side    side of the box that a card shows; empty: the thumbnail
    """

    shapes: list[Shape]
    box: Box
    side: str


def draw_preview(wanted: Preview) -> NDArray[np.uint8]:
    """Return the image of a preview, uint8 (h, w, 3) or (h, w, 4)."""
    shapes = wanted.shapes
    if not wanted.side:
        low = np.min([shape.positions.min(axis=0) for shape in shapes], axis=0)
        high = np.max([shape.positions.max(axis=0) for shape in shapes], axis=0)
        frame = tuple(low.tolist()), tuple(high.tolist())
        return draw_pixels(shapes, frame, (_THUMBNAIL_WIDTH, _THUMBNAIL_WIDTH))
    right, up, to_eye, turns = _SIDES[wanted.side]
    axes = np.array([right, up, to_eye], np.float64).T
    upright = draw_side(shapes, wanted.box, axes, _CARD_EDGE)
    return np.ascontiguousarray(np.rot90(upright, turns))


Draw = Callable[[Preview], NDArray[np.uint8]]
# Returns the results of a function for tasks, each with a name.
RunAll = Callable[[Draw, Sequence[tuple[str, Preview]]], list[NDArray[np.uint8]]]


def run_here(draw: Draw, tasks: Sequence[tuple[str, Preview]]) -> list[NDArray[np.uint8]]:
    """Draw previews one after another in this process."""
    return [draw(task) for _, task in tasks]


def write_previews(stage_dir: Path, as_written: AsWritten, run_all: RunAll = run_here) -> bool:
    """Draw the previews of a stage, and refer to them in stage.usda.

    run_all  draws them, for example on several processes

    Returns whether there are previews: a specimen without surfaces has none. Raises OutputError if
    a file can't be written.
    """
    path = stage_dir / STAGE_NAME
    stage = open_stage(path)
    tiles = tile_prims(stage)
    found, _ = find_parts(stage, tiles, as_written)
    boxes = np.array([hinted_box(prim) for prim in tiles])
    box = tuple(boxes[:, 0].min(axis=0).tolist()), tuple(boxes[:, 1].max(axis=0).tolist())
    with replacing_folder(stage_dir / PREVIEWS) as folder:
        if found:
            shapes = [_shape_of(part.lod) for part in found]
            names = {_THUMBNAIL: "", **{_card_name(side): side for side in _SIDES}}
            tasks = [(name, Preview(shapes, box, side)) for name, side in names.items()]
            for name, pixels in zip(names, run_all(draw_preview, tasks), strict=True):
                _save(pixels, folder / name)
    if found:
        _name_previews(stage, path)
    return bool(found)


def _save(pixels: NDArray[np.uint8], file: Path) -> None:
    Image.fromarray(pixels).save(file, format="PNG")


def _card_name(side: str) -> str:
    return f"card_{side.lower()}.png"


def _shape_of(lod: ComposedLod) -> Shape:
    mesh = lod.mesh
    color: NDArray[np.float64] = np.array(lod.material.color)
    if mesh.colors is not None:
        color = mesh.colors.astype(np.float64)
    elif lod.maps.color is not None and mesh.uvs is not None:
        with Image.open(lod.maps.color) as image:
            texels = np.asarray(image.convert("RGB"))
        height, width = texels.shape[:2]
        column = np.clip(np.rint(mesh.uvs[:, 0] * width - 0.5), 0, width - 1).astype(int)
        row = np.clip(np.rint((1 - mesh.uvs[:, 1]) * height - 0.5), 0, height - 1).astype(int)
        steps = np.array([linear_color((byte, 0, 0))[0] for byte in range(256)])
        color = steps[texels[row, column]]
    return Shape(mesh.positions, mesh.triangles, mesh.normals, color)


def _name_previews(stage: Usd.Stage, path: Path) -> None:
    root = stage.GetPrimAtPath(ROOT)
    thumbnail = UsdMedia.AssetPreviewsAPI.Thumbnails(Sdf.AssetPath(f"./{PREVIEWS}/{_THUMBNAIL}"))
    UsdMedia.AssetPreviewsAPI.Apply(root).SetDefaultThumbnails(thumbnail)
    model = UsdGeom.ModelAPI.Apply(root)
    model.CreateModelCardGeometryAttr(UsdGeom.Tokens.box)
    model.CreateModelApplyDrawModeAttr(True)
    for side in _SIDES:
        attribute = getattr(model, f"CreateModelCardTexture{side}Attr")()
        attribute.Set(Sdf.AssetPath(f"./{PREVIEWS}/{_card_name(side)}"))
    export(stage.GetRootLayer(), path)
