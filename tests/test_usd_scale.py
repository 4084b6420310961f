"""A stage of 22 x 11 tiles and three channels opens at once, its payloads unloaded."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from stereocell.mesh import Lod, Mesh
from stereocell.specimen import ChannelContent, Look, TileContent
from stereocell.write.usd import TileExtent, write_stage, write_tile

COLUMNS, ROWS, CHANNELS = 22, 11, 3
EDGE = 4  # voxels of a tile

# measured in a process of its own, since memory is the most that a process ever held
OPEN = """
import json, sys, time
from pathlib import Path
from stereocell.write.composed import open_stage
from stereocell.write.composed_look import read_looks
from pxr import Usd, UsdGeom
def memory_mb(key):  # VmHWM: the most so far; of getrusage, a child inherits its parent's
    (line,) = [s for s in open("/proc/self/status") if s.startswith(key)]
    return int(line.split()[1]) / 1024
before_mb = memory_mb("VmRSS")
start = time.perf_counter()
stage = open_stage(Path(sys.argv[1]))
opened_s = time.perf_counter() - start
tiles = stage.GetPrimAtPath("/Specimen/Tiles").GetAllChildren()
cache = UsdGeom.BBoxCache(0, ["default"], useExtentsHint=True)
box = cache.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
print(json.dumps({
    "opened_s": opened_s,
    "peak_mb": memory_mb("VmHWM"),
    "before_mb": before_mb,
    "tiles": len(tiles),
    "loaded": sum(tile.IsLoaded() for tile in tiles),
    "selected": sorted({t.GetVariantSets().GetAllVariantSelections()["lod"] for t in tiles}),
    "width": box.GetSize()[0],
    "channels": len(read_looks(stage)),
}))
"""


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
@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")
def test_242_tiles_of_3_channels_open_in_3_s_and_300_mb(tmp_path: Path) -> None:
    ramp = {"default": ((0.0, 0.0), (1.0, 1.0))}
    looks = [
        Look(f"channel {k}", (0.1 * k, 0.5, 0.5), (0.0, 9.0), 4.0, 1.0, ramp)
        for k in range(CHANNELS)
    ]
    extents = []
    for row in range(ROWS):
        for column in range(COLUMNS):
            tile = content(row, column, looks)
            write_tile(tmp_path, tile)
            extents.append(TileExtent.of(tile))
    write_stage(tmp_path, "many", looks, extents, {})
    command = [sys.executable, "-c", OPEN, str(tmp_path / "stage.usda")]
    found = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    assert (found["tiles"], found["loaded"], found["channels"]) == (242, 0, 3)
    assert found["selected"] == ["lod1"]  # known without its payload
    assert found["width"] == COLUMNS * EDGE
    assert found["opened_s"] < 3, found
    assert found["peak_mb"] < 300, found
    sys.stdout.write(f"{found}\n")
