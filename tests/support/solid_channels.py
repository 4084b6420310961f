"""A stage of three channels with closed surfaces: a tissue, a nucleus in it, a vessel above."""

from pathlib import Path

import numpy as np

from stereocell.model.channel import Appearance
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.tile_content import ChannelContent, TileContent
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from support.object_bundle import ball

# center and radius of each channel, um; the nucleus is listed before the tissue that encloses it
BALLS = {
    "nucleus": ((12.0, -12.0, 12.0), 3.0),
    "tissue": ((12.0, -12.0, 12.0), 8.0),
    "vessel": ((30.0, -20.0, 20.0), 4.0),
}
COLORS = {"nucleus": (0.1, 0.3, 1.0), "tissue": (0.0, 1.0, 0.0), "vessel": (1.0, 0.2, 0.1)}


def write_solid_channels(folder: Path, *, is_open: bool = False) -> Path:
    """Write the stage; return its root layer. With `is_open`, the vessel has no bottom."""
    contents = []
    for name, (center, radius) in BALLS.items():
        out, triangles = ball(24)
        positions = (np.array(center) + radius * out).astype(np.float32)
        if is_open and name == "vessel":
            triangles = triangles[~(positions[triangles][..., 2] < center[2]).all(axis=1)]
        mesh = Mesh(positions, triangles, out.astype(np.float32))
        contents.append(ChannelContent(name, (Lod(mesh, 0.1),), None))
    tile = TileContent(
        "r0_c0", (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (32.0, 32.0, 40.0), (33, 33, 41), tuple(contents)
    )
    write_tile(folder, tile)
    looks = tuple(
        Appearance(
            name, color, (0.0, 255.0), 1.0, 1.0, "clear", {"default": ((0.0, 0.0), (1.0, 1.0))}
        )
        for name, color in COLORS.items()
    )
    write_stage(
        folder, "three <solids>", appearances=looks, tiles=[TileExtent.of(tile)], provenance={}
    )
    return folder / "stage.usda"
