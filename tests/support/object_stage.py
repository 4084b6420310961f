"""A stage of a label map: a ball in each of two tiles, and a beam that is cut between them."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stereocell.model.channel import Appearance
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.object_table import Column, ObjectTable
from stereocell.model.tile_content import ChannelContent, TileContent
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from support.object_bundle import ball

CUT_UM = 20.0  # where the second tile begins
LABELS = (7, 12, 300)  # balls, then the beam
CENTERS = ((8.0, -10.0, 8.0), (32.0, -10.0, 8.0))  # um, centres of the balls
RADIUS_UM = 5.0
BEAM = ((15.0, -4.0, 4.0), (27.0, -2.0, 10.0))  # um, low and high corner; cut at x = CUT_UM
TYPES = ("T cell", "vessel")
COLORS = ((0.2, 0.4, 0.8), (0.8, 0.2, 0.0))  # one for each type of object
APPEARANCE = Appearance(
    "cells", (1.0, 1.0, 1.0), (0.0, 255.0), 1.0, 1.0, "clear", {"default": ((0.0, 0.0), (1.0, 1.0))}
)


def write_objects(folder: Path) -> Path:
    """Write the stage; return its root layer."""
    codes = np.array([0, 0, 1], np.float32)
    volumes = np.array([524.0, 524.0, 144.0], np.float32)
    table = ObjectTable(
        np.array(LABELS, np.uint64),
        np.zeros((3, 6), np.float32),
        {"r0_c0": np.array([0, 2], np.int32), "r0_c1": np.array([1, 2], np.int32)},
        (
            Column("volume_um3", "Volume", volumes),
            Column("type", "Type", codes, "", "", TYPES, COLORS),
        ),
        names=("left", "", "beam"),
        default="type",
    )
    tiles = [_tile(column, table) for column in (0, 1)]
    for tile in tiles:
        write_tile(folder, tile)
    write_stage(
        folder,
        "cells",
        appearances=(APPEARANCE,),
        tiles=[TileExtent.of(tile) for tile in tiles],
        provenance={},
        tables={"cells": table},
    )
    return folder / "stage.usda"


def _tile(column: int, table: ObjectTable) -> TileContent:
    name = f"r0_c{column}"
    low, high = (np.array(end) for end in BEAM)
    (low if column else high)[0] = CUT_UM
    out, faces = ball(12)
    parts = [(np.array(CENTERS[column]) + RADIUS_UM * out, faces), _open_box(low, high, column)]
    counts = [len(points) for points, _ in parts]
    points = np.concatenate([points for points, _ in parts]).astype(np.float32)
    triangles = np.concatenate([parts[0][1], parts[1][1] + counts[0]]).astype(np.uint32)
    up = np.tile(np.float32([0, 0, 1]), (len(points), 1))
    mesh = Mesh(points, triangles, up, objects=np.repeat([0, 1], counts).astype(np.int32))
    content = ChannelContent("cells", (Lod(mesh, 0.1),), None, objects=table.of_tile(name))
    first = (0.0, 0.0, CUT_UM * column)
    last = (16.0, 20.0, CUT_UM * (column + 1))
    return TileContent(name, (1.0, 1.0, 1.0), first, last, (17, 21, 20 + column), (content,))


def _open_box(
    low: NDArray[np.float64], high: NDArray[np.float64], column: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return a box without its face at the cut."""
    corners = np.array(
        [[(low, high)[(k >> axis) & 1][axis] for axis in range(3)] for k in range(8)]
    )
    faces = {"x0": (0, 4, 6, 2), "x1": (1, 3, 7, 5), "y0": (0, 1, 5, 4), "y1": (2, 6, 7, 3)}
    faces |= {"z0": (0, 2, 3, 1), "z1": (4, 5, 7, 6)}
    del faces["x0" if column else "x1"]
    quads = np.array(list(faces.values()))
    return corners, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
