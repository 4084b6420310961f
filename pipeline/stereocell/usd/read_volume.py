"""Find the files with the voxels of a loaded tile, and the volume's place in the world."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdVol

from stereocell.formats.vdb import GRID_NAME, MEASURED_NAME
from stereocell.model.errors import StageError
from stereocell.usd.drawn_prims import drawn, to_world
from stereocell.usd.read_attributes import (
    Point,
    file_of,
    point_of,
    sizes_of,
)
from stereocell.usd.typed_values import read_as


@dataclass(frozen=True, slots=True)
class ComposedVolume:
    """The volume of a channel in one tile: its files and its place.

    atlas       image file with the voxels that the bundle shows
    field       .vdb that other programs draw; None: the stage names none
    measured    .vdb with the voxels as measured; None: the stage does not keep them
    size        voxels (x, y, z), including the apron
    apron       width of the border around the tile's own box, in voxels on each side
    low, high   corners (x, y, z) of the box inside the apron, um, in the volume's own space
    matrix      (4, 4) for row vectors, from the volume's own space to world um
    """

    atlas: Path
    field: Path | None
    measured: Path | None
    size: tuple[int, int, int]
    apron: int
    low: Point
    high: Point
    matrix: NDArray[np.float64]


def read_volume(tile: Usd.Prim, channel_id: str) -> ComposedVolume | None:
    """Return a loaded tile's volume of one channel; None if it is not drawn.

    Raises StageError if attributes are missing or contradict each other.
    """
    name = f"{channel_id}_{tile.GetName()}_volume"
    prim = drawn(tile, tile.GetPath().AppendPath(f"{channel_id}/{name}"))
    if prim is None:
        return None
    width, height, depth = sizes_of(prim, "stereocell:atlasSize", 3)
    (apron,) = sizes_of(prim, "stereocell:apron", 1)
    if min(width, height, depth) <= 2 * apron:
        raise StageError(
            f"{prim.GetPath()}.stereocell:atlasSize: found {width}, {height}, {depth}, expected "
            f"more than {2 * apron} voxels along each axis, since the apron has {apron}"
        )
    return ComposedVolume(
        file_of(prim.GetAttribute("stereocell:atlas")),
        _field_of(prim, GRID_NAME),
        _field_of(prim, MEASURED_NAME),
        (width, height, depth),
        apron,
        point_of(prim, "stereocell:boundsMin"),
        point_of(prim, "stereocell:boundsMax"),
        to_world(prim),
    )


def _field_of(volume: Usd.Prim, name: str) -> Path | None:
    """Return the file of a volume's field; None: the volume has no such field or file."""
    path = UsdVol.Volume(volume).GetFieldPath(name)
    prim = volume.GetStage().GetPrimAtPath(path) if path else None
    path_of_file = UsdVol.FieldAsset(prim).GetFilePathAttr() if prim else None
    asset = read_as(path_of_file, Sdf.ValueTypeNames.Asset) if path_of_file else None
    return Path(asset.resolvedPath) if asset and asset.resolvedPath else None
