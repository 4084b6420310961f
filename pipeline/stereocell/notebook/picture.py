"""Draw a picture of a build for a notebook that no browser has opened, as the report does.

For each opacity below 1, the picture is drawn again with the channels of that opacity, and blended
with the picture so far. This is exact where one translucent channel lies over others, which holds
for most pixels.
"""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from stereocell.building.out_folder import OutFolder
from stereocell.export.chosen import Chosen
from stereocell.export.options import ExportOptions
from stereocell.model.color import linear_color
from stereocell.model.errors import StageError
from stereocell.report.draw_scenes import draw_image
from stereocell.textures.draw_meshes import Shape

Appearances = Mapping[str, Mapping[str, Any]]  # by the channel's ID, as in `Viewer.channels`

_WIDTH = 640  # pixels; small, since a notebook stores pictures as text
_TRIANGLES = 100_000  # triangles; more take seconds and show no finer details


def no_picture(_: Appearances) -> bytes:
    """Return no bytes, for a viewer without a picture."""
    return b""


def draw(out: Path, appearances: Appearances) -> bytes:
    """Return a PNG of OUT's surfaces; empty if none is shown, since volumes are not drawn here."""
    try:
        chosen = Chosen(OutFolder(out).stage_file, ExportOptions(), lambda _: None)
        layers = _layers(chosen, appearances)
    except StageError:
        return b""
    if not layers:
        return b""
    everything = [shape for shapes in layers.values() for shape in shapes]
    low = np.min([shape.positions.min(axis=0) for shape in everything], axis=0)
    high = np.max([shape.positions.max(axis=0) for shape in everything], axis=0)
    frame = tuple(low.tolist()), tuple(high.tolist())
    picture: Image.Image | None = None
    drawn: list[Shape] = []
    for opacity in sorted(layers, reverse=True):
        drawn += layers[opacity]
        over = draw_image(drawn, frame, (_WIDTH, _WIDTH))
        picture = over if picture is None else Image.blend(picture, over, opacity)
    assert picture is not None
    file = io.BytesIO()
    picture.save(file, "PNG", optimize=True)
    return file.getvalue()


def _layers(chosen: Chosen, appearances: Appearances) -> dict[float, list[Shape]]:
    """Return the visible shapes by their opacity. Raises StageError if the stage has no surface."""
    layers: dict[float, list[Shape]] = {}
    for piece in chosen.pieces(chosen.levels(light=_TRIANGLES)[0]):
        own = appearances.get(piece.channel.id, {})
        opacity = float(own.get("opacity", 1))
        if not (own.get("visible", True) and opacity):
            continue
        color = np.array(piece.material.color)
        if "color" in own:
            red, green, blue = bytes.fromhex(own["color"].removeprefix("#"))
            color = np.array(linear_color((red, green, blue)))
        mesh = piece.mesh
        shape = Shape(mesh.positions, mesh.triangles, mesh.normals, color)
        layers.setdefault(opacity, []).append(shape)
    return layers
