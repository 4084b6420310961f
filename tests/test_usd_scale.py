"""A stage of 22 x 11 tiles and three channels opens with its payloads unloaded."""

from pathlib import Path

import numpy as np
import pytest
from pxr import UsdGeom

from stereocell.mesh import Lod, Mesh
from stereocell.specimen import ChannelContent, Look, TileContent
from stereocell.write.composed import open_stage
from stereocell.write.composed_look import read_looks
from stereocell.write.usd import TileExtent, write_stage, write_tile

COLUMNS, ROWS, CHANNELS = 22, 11, 3
EDGE = 4  # voxels of a tile


def content(row: int, column: int, looks: list[Look]) -> TileContent:
    first = (0.0, row * EDGE * 1.0, column * EDGE * 1.0)
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    corners += np.array([first[2], -first[1] - 1, 1], np.float32)
    up = np.tile(np.array([0, 0, 1], np.float32), (3, 1))
    mesh = Mesh(corners, np.array([[0, 1, 2]], np.uint32), up)
    lods = (Lod(mesh, 0.0), Lod(mesh, 0.5))
    volume = np.full((EDGE + 2,) * 3, 7, np.uint8)
    last = tuple(start + EDGE - 1 for start in first)
    channels = tuple(ChannelContent(look.id, lods, volume) for look in looks)
    return TileContent(f"r{row}_c{column}", (1.0, 1.0, 1.0), first, last, (EDGE,) * 3, channels)


@pytest.mark.slow
def test_242_tiles_are_known_without_their_payloads(tmp_path: Path) -> None:
    ramp = {"default": ((0.0, 0.0), (1.0, 1.0))}
    looks = [
        Look(f"channel {k}", (0.1 * k, 0.5, 0.5), (0.0, 9.0), 4.0, 1.0, "clear", ramp)
        for k in range(CHANNELS)
    ]
    extents = []
    for row in range(ROWS):
        for column in range(COLUMNS):
            tile = content(row, column, looks)
            write_tile(tmp_path, tile)
            extents.append(TileExtent.of(tile))
    write_stage(tmp_path, "many", looks, extents, {})
    stage = open_stage(tmp_path / "stage.usda")
    tiles = stage.GetPrimAtPath("/Specimen/Tiles").GetAllChildren()
    assert len(tiles) == COLUMNS * ROWS
    assert not any(tile.IsLoaded() for tile in tiles)
    assert {t.GetVariantSets().GetAllVariantSelections()["lod"] for t in tiles} == {"lod1"}
    cache = UsdGeom.BBoxCache(0, ["default"], useExtentsHint=True)
    box = cache.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
    assert box.GetSize()[0] == COLUMNS * EDGE
    assert len(read_looks(stage)) == CHANNELS
