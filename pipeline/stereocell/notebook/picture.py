"""A picture of a build, for a notebook that no browser has opened: drawn as the report draws.

Channels that are seen through are drawn one more time each, and mixed with what is behind: exact
where one of them lies over another, which is most of a picture.
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

Looks = Mapping[str, Mapping[str, Any]]  # by the channel's ID, as `Viewer.channels`

_WIDTH = 640  # pixels: a notebook has them as text
_TRIANGLES = 100_000  # more take seconds, and show no finer


def no_picture(_: Looks) -> bytes:
    """Return that there is none."""
    return b""


def draw(out: Path, looks: Looks) -> bytes:
    """Return a PNG of OUT's surfaces; empty where none is shown: the viewer draws volumes."""
    try:
        chosen = Chosen(OutFolder(out).stage_file, ExportOptions(), lambda _: None)
        layers = _layers(chosen, looks)
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


def _layers(chosen: Chosen, looks: Looks) -> dict[float, list[Shape]]:
    """Return the shapes that show, by their opacity. Raises StageError where there is none."""
    layers: dict[float, list[Shape]] = {}
    for piece in chosen.pieces(chosen.levels(light=_TRIANGLES)[0]):
        look = looks.get(piece.channel.id, {})
        opacity = float(look.get("opacity", 1))
        if not (look.get("visible", True) and opacity):
            continue
        color = np.array(piece.material.color)
        if "color" in look:
            red, green, blue = bytes.fromhex(look["color"].removeprefix("#"))
            color = np.array(linear_color((red, green, blue)))
        mesh = piece.mesh
        shape = Shape(mesh.positions, mesh.triangles, mesh.normals, color)
        layers.setdefault(opacity, []).append(shape)
    return layers
