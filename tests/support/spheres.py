"""Two tiles side by side with a sphere across their border: tiny content for stage and bundle."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stereocell.model.channel import Appearance
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.tile_content import ChannelContent, TileContent
from stereocell.transfer.joint_histogram import to_eight_bits
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile

SPACING = (1.0, 0.5, 0.5)  # um, (z, y, x)
OWN_SHAPE = (9, 20, 20)
CENTER = np.array([10.0, -5.0, 4.0])  # on the border of the two tiles
RADIUS = 3.5
LEVELS = ((24, 0.02), (16, 0.1), (8, 0.4))  # per level: rings of the sphere, and its distance in um

RED = Appearance(
    "CD31",
    (1.0, 0.2, 0.1),
    (100.0, 4000.0),
    1200.0,
    0.9,
    "clear",
    {"default": ((0.0, 0.0), (1.0, 0.8)), "sharp": ((0.3, 0.0), (0.31, 1.0))},
)
BLUE = Appearance(
    "Hoechst 33342",
    (0.1, 0.3, 1.0),
    (0.0, 255.0),
    None,
    0.0,
    "none",
    {"default": ((0.0, 0.0), (1.0, 0.5))},
)


def sphere(rings: int, keep: slice) -> Mesh:
    """Return half of a UV sphere, cut at x = 10 um.

    keep  the vertices' longitudes from 0 to 2 * rings that belong to the half

    The vertices on the cut are the same floats in both halves.
    """
    u, v = np.meshgrid(np.linspace(0, 1, 2 * rings + 1), np.linspace(0, 1, rings + 1))
    longitude, latitude = 2 * np.pi * u + np.pi / 2, np.pi * (1 - v)
    out = np.stack(
        [
            np.sin(latitude) * np.cos(longitude),
            np.cos(latitude),
            -np.sin(latitude) * np.sin(longitude),
        ],
        axis=-1,
    )
    along = np.stack([-np.sin(longitude), 0 * longitude, -np.cos(longitude), 0 * u + 1], axis=-1)
    positions = CENTER + RADIUS * out
    positions[:, [0, rings, 2 * rings], 0] = CENTER[0]
    grid = np.arange(u.size).reshape(u.shape)[:, keep]
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    quads = [np.stack(corners, -1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    used, triangles = np.unique(np.concatenate(quads), return_inverse=True)
    return Mesh(
        positions.reshape(-1, 3)[used].astype(np.float32),
        triangles.reshape(-1, 3).astype(np.uint32),
        out.reshape(-1, 3)[used].astype(np.float32),
        np.stack([u, v], -1).reshape(-1, 2)[used].astype(np.float32),
        along.reshape(-1, 4)[used].astype(np.float32),
    )


def ball(origin: tuple[int, int, int], shape: tuple[int, int, int]) -> NDArray[np.uint8]:
    """Return voxels (z, y, x) from `origin` on, which are bright inside the ball."""
    z, y, x = np.indices(shape) + np.reshape(origin, (3, 1, 1, 1))
    world = np.stack([x * SPACING[2], -y * SPACING[1], z * SPACING[0]])
    distance = np.linalg.norm(world - CENTER[:, None, None, None], axis=0)
    return np.clip(128 + 60 * (RADIUS - distance), 0, 255).astype(np.uint8)


def counts(origin: tuple[int, int, int], shape: tuple[int, int, int]) -> NDArray[np.uint16]:
    """Return voxels (z, y, x) from `origin` on, with counts of a 12-bit camera.

    They have more values than the 8 bits to which the window of RED maps them.
    """
    z, y, x = np.indices(shape) + np.reshape(origin, (3, 1, 1, 1))
    return (100 + (977 * z + 131 * y + 29 * x) % 3901).astype(np.uint16)


def tile(
    column: int, appearances: tuple[Appearance, ...] = (RED, BLUE), *, measured: bool = False
) -> TileContent:
    """Return tile r0_c0 (x 0 to 10 um) or r0_c1 (10 to 19.5 um); only CD31 has a surface.

    measured  whether CD31's voxels are those of `counts`, and the stage keeps them as measured
    """
    lattice = (9, 20, 21) if column == 0 else OWN_SHAPE
    first = (0.0, 0.0, 10.0 * column)
    last = tuple(a + (n - 1) * s for a, n, s in zip(first, lattice, SPACING, strict=True))
    origin, shape = (-1, -1, 20 * column - 1), tuple(n + 2 for n in lattice)
    volume = ball(origin, shape)
    flat = np.full((32, 32, 3), (128, 128, 255), np.uint8)
    lods = []
    for level, (rings, distance) in enumerate(LEVELS):
        # longitude 0 points to +z at x = 10: the first half of the longitudes lies left of it
        keep = slice(0, rings + 1) if column == 0 else slice(rings, None)
        lods.append(Lod(sphere(rings, keep), distance, flat if level else None))
    contents = tuple(
        ChannelContent(
            appearance.id,
            tuple(lods) if appearance.iso_value else (),
            volume,
            color=appearance.color,
        )
        for appearance in appearances
    )
    if measured:
        kept = counts(origin, shape)
        own = replace(contents[0], volume=to_eight_bits(kept, RED.window), measured=kept)
        contents = (own, *contents[1:])
    return TileContent(f"r0_c{column}", SPACING, first, last, OWN_SHAPE, contents)


def write_one_tile(stage: Path) -> None:
    """Write a stage of one tile, with both channels."""
    content = tile(0)
    write_tile(stage, content)
    write_stage(
        stage,
        "one tile",
        appearances=(RED, BLUE),
        tiles=[TileExtent.of(content)],
        provenance={},
    )
