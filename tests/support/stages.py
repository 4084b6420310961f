"""A small stage to write and to read back: a letter F in two tiles, and two more channels.

The first channel, with a Greek letter in its name, is the F; `Hoechst 33342` is a ball on the cut;
`1st` is empty and has no surface.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd
from scipy import ndimage
from skimage.measure import marching_cubes

from stereocell.model.channel import Appearance
from stereocell.model.identifiers import to_identifier
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.tile_content import ChannelContent, TileContent
from stereocell.model.volume import zyx_to_xyz
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from support.phantoms import F_BACKGROUND, F_BODY, blurred_ball, f_phantom

# The beginning of an artist's layer.
HEAD = '#usda 1.0\n(defaultPrim = "Specimen"\nmetersPerUnit = 1e-6\nupAxis = "Y"\n'
NAMES = ("CD3\N{GREEK SMALL LETTER EPSILON}", "Hoechst 33342", "1st")
F_ID, BALL_ID, EMPTY_ID = (to_identifier(name) for name in NAMES)
COLORS = ((0.8, 0.1, 0.1), (0.1, 0.2, 0.9), (0.1, 0.7, 0.2))
SPACING_UM = (0.5, 0.25, 0.25)
SHAPE = (16, 48, 36)
# For each tile, voxels along x: first and end of its own voxels, and the end of its lattice
CUTS = ((0, 18, 19), (18, 36, 36))
TILES = ("r0_c0", "r0_c1")
FUNCTIONS = {
    "default": ((0.0, 0.0), (0.3, 0.0), (0.5, 0.3), (1.0, 0.8)),
    "soft": ((0.0, 0.0), (1.0, 0.2)),
    "sharp": ((0.0, 0.0), (0.48, 0.0), (0.52, 0.9), (1.0, 0.9)),
    "surface": ((0.0, 0.0), (0.4, 0.0), (0.5, 0.5), (0.6, 0.0), (1.0, 0.0)),
}


def leaf(tile: str, channel: str, suffix: str = "") -> str:
    """Return the path of a channel's mesh in a tile, or of the prim beside it with this suffix."""
    return f"/Specimen/Tiles/{tile}/{channel}/{channel}_{tile}{suffix}"


def make_fields() -> tuple[NDArray[np.float32], ...]:
    """Return the channels, float32 (z, y, x) in 0..1."""
    letter = (f_phantom().astype(np.float32) - F_BACKGROUND) / (F_BODY - F_BACKGROUND)
    ball = blurred_ball(SHAPE, SPACING_UM, (4.0, 8.0, 4.5), 2.0, 0.4)
    return letter, ball, np.zeros(SHAPE, np.float32)


def make_tiles() -> list[TileContent]:
    fields = make_fields()
    tiles = []
    for tile, (start, stop, end) in zip(TILES, CUTS, strict=True):
        channels = tuple(
            ChannelContent(
                to_identifier(name),
                _make_lods(field, start, end),
                _make_volume(field, start, end),
                color=color,
            )
            for name, field, color in zip(NAMES, fields, COLORS, strict=True)
        )
        depth, height, width = SPACING_UM
        first = (0.0, 0.0, start * width)
        last = ((SHAPE[0] - 1) * depth, (SHAPE[1] - 1) * height, (end - 1) * width)
        own = (SHAPE[0], SHAPE[1], stop - start)
        tiles.append(TileContent(tile, SPACING_UM, first, last, own, channels))
    return tiles


def make_appearances() -> list[Appearance]:
    return [
        Appearance(name, color, (100.0, 1100.0), None, 0.0, "none", FUNCTIONS)
        if name == "1st"
        else Appearance(name, color, (100.0, 1100.0), 600.0, 0.75, "clear", FUNCTIONS)
        for name, color in zip(NAMES, COLORS, strict=True)
    ]


def write_whole(folder: Path) -> Path:
    """Write the stage and return the path of its root layer."""
    tiles = make_tiles()
    for tile in tiles:
        write_tile(folder, tile)
    provenance = {"generator": "tests", "seed": 1, "settings": {"lod.errors": [0.1, 0.4]}}
    write_stage(
        folder,
        "F",
        appearances=make_appearances(),
        tiles=[TileExtent.of(t) for t in tiles],
        provenance=provenance,
    )
    return folder / "stage.usda"


def edit_over(path: Path, sublayer: Path | str, change: Callable[[Usd.Stage], object]) -> Path:
    """Write a new layer over a stage, with the stage's units and a change; return its path."""
    layer = Sdf.Layer.CreateNew(str(path))
    layer.ImportFromString(f"{HEAD}subLayers = [@{sublayer}@])\n")
    change(Usd.Stage.Open(layer))
    layer.Save()
    return path


def _make_volume(field: NDArray[np.float32], start: int, end: int) -> NDArray[np.uint8]:
    padded = np.pad(np.rint(field * 255).astype(np.uint8), 1, mode="edge")
    return np.ascontiguousarray(padded[:, :, start : end + 2])


def _make_lods(field: NDArray[np.float32], start: int, end: int) -> tuple[Lod, ...]:
    if not field.any():
        return ()
    fine, coarse = (_extract(field[:, :, start:end], start, step) for step in (1, 2))
    box = np.ptp(coarse.positions, axis=0)
    uvs = ((coarse.positions - coarse.positions.min(axis=0)) / box)[:, :2]
    tangents = np.cross([0.0, 1.0, 0.2], coarse.normals)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    signed = np.column_stack([tangents, np.ones(len(tangents))]).astype(np.float32)
    mapped = Mesh(coarse.positions, coarse.triangles, coarse.normals, uvs, signed)
    flat = np.full((16, 16, 3), (128, 128, 255), np.uint8)
    return Lod(fine, 0.0), Lod(fine, 0.1), Lod(mapped, 0.3, flat)


def _extract(field: NDArray[np.float32], start: int, step: int) -> Mesh:
    """Return the surface at one half, with normals against the gradient."""
    points, faces, _, _ = marching_cubes(field, 0.5, step_size=step)
    slopes = [np.asarray(g) for g in np.gradient(ndimage.gaussian_filter(field, 1), *SPACING_UM)]
    sampled = [ndimage.map_coordinates(g, points.T, order=1, mode="nearest") for g in slopes]
    normals = -zyx_to_xyz(np.stack(sampled, axis=-1))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    world = zyx_to_xyz((points + np.array([0, 0, start])) * SPACING_UM)
    a, b, c = (world[faces[:, k]] for k in range(3))
    if (np.cross(b - a, c - a) * normals[faces[:, 0]]).sum() < 0:
        faces = faces[:, ::-1]
    return Mesh(world.astype(np.float32), faces.astype(np.uint32), normals.astype(np.float32))


def has_schema() -> bool:
    definition = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition("StereoCellChannelAPI")
    return definition is not None and "stereocell:lut" in definition.GetPropertyNames()
