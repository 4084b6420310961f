"""A stage of many tiles."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from stereocell.model.channel import Appearance
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.tile_content import ChannelContent, TileContent
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from stereocell.usd.write_tile import LAYER_NAME

COLUMNS, ROWS, CHANNELS = 22, 11, 70


EDGE = 4  # voxels along each edge of a tile


# Runs in a process of its own, because earlier tests raise the peak memory of this process. Prints
# its findings as JSON; growth_kib is null where /proc has no peak.
OPEN = """
import json, re, sys, time
from pathlib import Path
from pxr import UsdGeom
from stereocell.usd.read_stage import open_stage
from stereocell.usd.read_appearances import read_appearances

def peak_kib():
    status = Path("/proc/self/status")
    found = status.is_file() and re.search(r"VmHWM:\\s+(\\d+) kB", status.read_text("utf-8"))
    return int(found[1]) if found else None

before, start = peak_kib(), time.perf_counter()
stage = open_stage(Path(sys.argv[1]))
tiles = stage.GetPrimAtPath("/Specimen/Tiles").GetAllChildren()
cache = UsdGeom.BBoxCache(0, ["default"], useExtentsHint=True)
box = cache.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
appearances = len(read_appearances(stage))
seconds, after = time.perf_counter() - start, peak_kib()
print(json.dumps({
    "tiles": len(tiles),
    "loaded": sum(tile.IsLoaded() for tile in tiles),
    "lods": sorted({t.GetVariantSets().GetAllVariantSelections()["lod"] for t in tiles}),
    "width_um": box.GetSize()[0],
    "appearances": appearances,
    "seconds": seconds,
    "growth_kib": None if before is None or after is None else after - before,
}))
"""


def content(row: int, column: int, appearances: list[Appearance]) -> TileContent:
    first = (0.0, row * EDGE * 1.0, column * EDGE * 1.0)
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    corners += np.array([first[2], -first[1] - 1, 1], np.float32)
    up = np.tile(np.array([0, 0, 1], np.float32), (3, 1))
    mesh = Mesh(corners, np.array([[0, 1, 2]], np.uint32), up)
    lods = (Lod(mesh, 0.0), Lod(mesh, 0.5))
    volume = np.full((EDGE + 2,) * 3, 7, np.uint8)
    last = tuple(start + EDGE - 1 for start in first)
    channels = tuple(ChannelContent(appearance.id, lods, volume) for appearance in appearances)
    return TileContent(f"r{row}_c{column}", (1.0, 1.0, 1.0), first, last, (EDGE,) * 3, channels)


def write_many(folder: Path) -> Path:
    """Write the stage; return its root layer."""
    functions = ("default", "sharp", "soft", "surface", "threshold")
    ramps = dict.fromkeys(functions, ((0.0, 0.0), (1.0, 1.0)))
    appearances = [
        Appearance(f"channel {k}", (k / CHANNELS, 0.5, 0.5), (0.0, 9.0), 4.0, 1.0, "clear", ramps)
        for k in range(CHANNELS)
    ]
    places = [(row, column) for row in range(ROWS) for column in range(COLUMNS)]
    extents = [TileExtent.of(content(row, column, appearances[:1])) for row, column in places]
    write_tile(folder, content(*places[0], appearances))
    first, *others = (folder / "tiles" / extent.id / LAYER_NAME for extent in extents)
    for layer in others:
        layer.parent.mkdir()
        shutil.copyfile(first, layer)
    write_stage(folder, "many", appearances=appearances, tiles=extents, provenance={})
    return folder / "stage.usda"


def open_unloaded(stage: Path) -> dict[str, Any]:
    """Open a stage in a process of its own; return its findings, seconds and growth of memory."""
    run = subprocess.run(
        [sys.executable, "-c", OPEN, str(stage)], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    seen: dict[str, Any] = json.loads(run.stdout)
    return seen
