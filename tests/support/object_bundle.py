"""A bundle of a label map in two tiles, for the viewer's tests, too: closed cells and their table.

`python -m support.object_bundle FOLDER [--wide]` writes the bundle. Cells are balls on a grid. A
cell's number on the grid is its row in the table, so a test knows where each cell is. The last
object is a box in both tiles, cut at their common plane. With `--wide`, the box has a label that
needs 64 bits. `--painted` stains the upper half of each ball.
"""

import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from stereocell.bundle.describe import describe_bundle
from stereocell.bundle.tile_part import BundleTile, write_file
from stereocell.bundle.write_objects import write_objects
from stereocell.formats.gltf import Material, choose_step, encode_glb
from stereocell.formats.gltf_features import Features
from stereocell.formats.ktx2 import encode_2d
from stereocell.formats.tiles3d import TileLod, make_tilesets
from stereocell.model.mesh import Mesh
from stereocell.model.object_table import MISSING, Column, ObjectTable
from stereocell.storage.file_list import encode
from stereocell.storage.json_files import compact_json

CHANNEL = "cells"
TILES = ("r0_c0", "r0_c1")
WIDTH_UM = 60.0  # width of a tile; the second tile begins where the first ends
GRID = (5, 3, 2)  # number of cells of a tile along x, y, z
APART_UM = 12.0
RADIUS_UM = 4.0
RINGS = (16, 8)  # rings of a ball at each level of detail, finest first
PER_TILE = GRID[0] * GRID[1] * GRID[2]
COUNT = 2 * PER_TILE + 1
COLORS = ((0.9, 0.2, 0.1), (0.1, 0.4, 0.9), (0.2, 0.7, 0.2))
# um (x, y, z), low and high corner of the box that lies in both tiles
BEAM = ((55.0, -45.0, 8.0), (65.0, -40.0, 16.0))
BOUNDS = ((0.0, -46.0, 0.0), (2 * WIDTH_UM, 0.0, 24.0))


def center(row: int) -> tuple[float, float, float]:
    """Return the centre (x, y, z), um, of the ball in a row of the table."""
    tile, rest = divmod(row, PER_TILE)
    x, rest = rest % GRID[0], rest // GRID[0]
    y, z = rest % GRID[1], rest // GRID[1]
    return (tile * WIDTH_UM + 6 + APART_UM * x, -6 - APART_UM * y, 6 + APART_UM * z)


def ball(rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors and triangles of a closed ball."""
    polar = np.pi * np.arange(1, rings) / rings
    around = np.pi * np.arange(2 * rings) / rings
    p, a = np.meshgrid(polar, around, indexing="ij")
    body = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], -1).reshape(-1, 3)
    points = np.vstack([body, [[0, 0, 1], [0, 0, -1]]])
    width, triangles = 2 * rings, []
    for i in range(width):
        j = (i + 1) % width
        triangles.append((len(body), i, j))
        last = (rings - 2) * width
        triangles.append((len(body) + 1, last + j, last + i))
        for ring in range(rings - 2):
            a0, b0 = ring * width + i, ring * width + j
            triangles += [(a0, a0 + width, b0), (b0, a0 + width, b0 + width)]
    return points, np.array(triangles, np.uint32)


def box(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points, normals and triangles of a closed box whose faces are flat."""
    points, normals, triangles = [], [], []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (low, high):
            normal = np.zeros(3)
            normal[axis] = 1 if end is high else -1
            start = len(points)
            for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = np.array(end, float)
                corner[u], corner[v] = (low, high)[x][u], (low, high)[y][v]
                points.append(corner)
                normals.append(normal)
            turned = ((0, 1, 2), (0, 2, 3)) if end is high else ((0, 2, 1), (0, 3, 2))
            triangles += [[start + i for i in corner] for corner in turned]
    return np.array(points), np.array(normals), np.array(triangles, np.uint32)


def tile_mesh(tile: int, rings: int, is_painted: bool = False) -> Mesh:
    """Return a tile's cells, numbered from 0 in their order; the piece of the beam is the last."""
    unit, faces = ball(rings)
    rows = range(tile * PER_TILE, (tile + 1) * PER_TILE)
    positions = [RADIUS_UM * unit + center(row) for row in rows]
    normals, triangles = [unit] * PER_TILE, [faces] * PER_TILE
    low, high = np.array(BEAM[0]), np.array(BEAM[1])
    (high if tile == 0 else low)[0] = WIDTH_UM
    for store, part in zip((positions, normals, triangles), box(low, high), strict=True):
        store.append(part)
    starts = np.cumsum([0, *(len(part) for part in positions[:-1])])
    paint = np.concatenate([*([unit[:, 1] > 0.1] * PER_TILE), np.zeros(len(positions[-1]))])
    return Mesh(
        np.vstack(positions).astype(np.float32),
        np.vstack([t + s for t, s in zip(triangles, starts, strict=True)]).astype(np.uint32),
        np.vstack(normals).astype(np.float32),
        objects=np.repeat(np.arange(len(positions)), [len(p) for p in positions]).astype(np.int32),
        paint=paint.astype(np.float32) if is_painted else None,
    )


def make_table(is_wide: bool = False, has_organs: bool = False) -> ObjectTable:
    """Return the table: `x_um` grows with x, `CD8` spreads over decades, one value is missing.

    `has_organs` adds 117 categories, as many as a whole body has, without stated colours.
    """
    rows = np.arange(COUNT)
    beam = COUNT - 1
    centers = np.array([center(row) for row in range(beam)])
    middle = np.mean(BEAM, axis=0)
    boxes = np.vstack([np.hstack([centers - RADIUS_UM, centers + RADIUS_UM]), np.ravel(BEAM)])
    volumes = np.full(COUNT, 4 / 3 * np.pi * RADIUS_UM**3)
    volumes[beam] = np.prod(np.subtract(BEAM[1], BEAM[0]))
    cd8 = 10 * 1.15**rows
    cd8[3] = np.nan
    kinds = np.array(rows % 3, float)
    kinds[4] = MISSING
    tiles = {
        name: np.array([*range(i * PER_TILE, (i + 1) * PER_TILE), beam], np.int32)
        for i, name in enumerate(TILES)
    }
    labels = (rows + 101).astype(np.uint64)
    if is_wide:
        labels[beam] = 2**63
    columns = (
        Column("volume_um3", "Volume", volumes.astype(np.float32), "Volume of its voxels", "um3"),
        Column("x_um", "x", np.append(centers[:, 0], middle[0]).astype(np.float32), "", "um"),
        Column("CD8", "CD8", cd8.astype(np.float32), "Mean over its voxels", "counts"),
        Column("row", "Row", rows.astype(np.float32)),
        Column(
            "cell_type",
            "Cell type",
            kinds.astype(np.float32),
            categories=("T cell", "B cell", "Tumour"),
            colors=COLORS,
        ),
    )
    if has_organs:
        named = tuple(f"organ {i + 1}" for i in range(117))
        columns = (*columns[:-1], replace(columns[-1], categories=named, colors=()))
    interfaces = [(row, row + 1) for row in range(beam) if row % GRID[0] < GRID[0] - 1]
    return ObjectTable(
        labels,
        boxes.astype(np.float32),
        tiles,
        columns,
        default="cell_type",
        interfaces=np.array(interfaces, np.int32),
        interface_um2=np.arange(1, len(interfaces) + 1, dtype=np.float32),
    )


def tile_features(table: ObjectTable, tile: str, *, wanted: tuple[str, ...] = ()) -> Features:
    """Return a tile's objects, with the table's first column and the columns in `wanted`."""
    rows = table.rows[tile]
    names = dict.fromkeys((table.columns[0].id, *wanted))
    found = [column for name in names if (column := table.column(name)) is not None]
    return Features(
        table.labels[rows], tuple(replace(column, values=column.values[rows]) for column in found)
    )


def write(
    root: Path, is_wide: bool = False, is_painted: bool = False, has_organs: bool = False
) -> None:
    """Write the bundle into a folder."""
    table, files = make_table(is_wide, has_organs), []

    def put(path, content):
        files.append(write_file(root, path, content))
        return files[-1]

    step_m, drawn, triangles = choose_step(WIDTH_UM), [], np.zeros(len(RINGS), int)
    for i, tile in enumerate(TILES):
        lods = []
        for level, rings in enumerate(RINGS):
            mesh = tile_mesh(i, rings, is_painted)
            glb = encode_glb(
                mesh,
                step_m,
                material=Material((0.8, 0.8, 0.8)),
                name=f"{CHANNEL}_{tile}",
                extras={"tile": tile, "channel": CHANNEL},
                features=tile_features(table, tile, wanted=("CD8", "cell_type")),
            )
            uri = f"{tile}/lod{level}.glb"
            ref = put(f"channels/{CHANNEL}/{uri}", glb.data)
            lods.append(TileLod(uri, ref.sha256, (0.0, 0.3)[level], glb.min_m, glb.max_m))
            triangles[level] += len(mesh.triangles)
        drawn.append(lods)
    tilesets = [put(f"channels/{CHANNEL}/{n}", data) for n, data in make_tilesets(drawn).items()]
    lut = put(f"luts/{CHANNEL}.ktx2", encode_2d(np.full((1, 256, 4), 255, np.uint8)).data)
    histogram = put("histogram2d.ktx2", encode_2d(np.zeros((64, 256, 1), np.uint8)).data)
    joint = {"gradient_max": 1.0, "functions": {}, "histogram": asdict(histogram), "most": 0}
    transfer2d = put(f"channels/{CHANNEL}/transfer2d.json", compact_json(joint))
    volumes = put(f"channels/{CHANNEL}/volumes.json", compact_json({"volumes": []}))
    objects, written = write_objects(
        root, f"channels/{CHANNEL}", table, paint="DNA" if is_painted else ""
    )
    files += written
    channel = {
        **{"id": CHANNEL, "name": "Cells", "color": [0.8, 0.8, 0.8], "window": [0, 1]},
        **{"iso_value": None, "iso_normalized": None, "threshold_normalized": None, "level": None},
        **{"surface": "clear", "surface_reason": "", "transfer_function": "default"},
        "transfer_functions": ["default"],
        "transfer_functions_2d": {"names": [], "file": asdict(transfer2d)},
        **{"lut": asdict(lut), "tileset": asdict(tilesets[0]), "volumes": asdict(volumes)},
        **{"triangles": triangles.tolist(), "objects": asdict(objects)},
    }
    (_, y0, z0), (_, y1, z1) = BOUNDS
    tiles = [
        BundleTile(name, "mesh", (i * WIDTH_UM, y0, z0), ((i + 1) * WIDTH_UM, y1, z1), ())
        for i, name in enumerate(TILES)
    ]
    listed = {ref.path: {"bytes": ref.bytes, "sha256": ref.sha256} for ref in files}
    index = write_file(root, "files.json", encode(listed))
    specimen = {"name": "Cells", "modality": ""}
    manifest = describe_bundle(specimen, tiles, channels=[channel], index=index)
    write_file(root, "manifest.json", manifest)


if __name__ == "__main__":
    write(Path(sys.argv[1]), *(flag in sys.argv for flag in ("--wide", "--painted", "--organs")))
