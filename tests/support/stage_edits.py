"""Input for the round-trip test: a volume of known appearance, and an artist's layer over it.

Six tiles in two rows. Channel `Balls` has a ball in the middle of each, `Slab` a block of one
intensity, `Sheet` a thin one. The layer recolours the balls, hides one tile and moves the one below
it into the gap, chooses another transfer function for the sheet and edits the slab's. It chooses
the volume for one tile, surface and volume for another, and the coarsest level for a third.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom

from support.phantoms import as_counts, blurred_ball, write_ome_tiff

SPACING_UM = (0.5, 0.5, 0.5)
TILE = (24, 32, 32)  # voxels (z, y, x)
COLUMNS, ROWS = 3, 2
RADIUS_UM = 4.0
# Voxels (z, y, x) that a block fills in each tile
SLAB = (slice(4, 20), slice(4, 28), slice(4, 28))
SHEET = (slice(11, 13), slice(4, 28), slice(4, 28))

COLOR = (0.8880, 0.2623, 0.0213)  # #f28c28
HIDDEN, MOVED = "r0_c1", "r1_c1"
VARIANTS = {
    "r0_c0": ("representation", "both"),
    "r0_c2": ("representation", "volume"),
    "r1_c2": ("lod", "lod3"),
}
MOVE_UM = (2.0, 7.0, 0.0)
FUNCTION = "sharp"  # not the function with which a microscope's stage opens
OPACITY_POINTS = ((0.0, 0.0), (0.5, 0.0), (0.51, 0.03), (1.0, 0.03))


def make_volume() -> NDArray[np.uint16]:
    """Return the three channels, uint16 (c, z, y, x)."""
    z, y, x = ((n - 1) / 2 * h for n, h in zip(TILE, SPACING_UM, strict=True))
    ball = blurred_ball(TILE, SPACING_UM, (z, y, x), RADIUS_UM, 0.5)
    blocks = np.zeros((2, *TILE), np.float32)
    blocks[0][SLAB] = blocks[1][SHEET] = 1
    tiles = [as_counts(field, 100, 1000) for field in (ball, *blocks)]
    return np.stack([np.tile(tile, (1, ROWS, COLUMNS)) for tile in tiles])


def write_volume(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    names = ("Balls", "Slab", "Sheet")
    write_ome_tiff(folder / "balls.ome.tif", make_volume(), "CZYX", SPACING_UM, names=names)


def write_layer(path: Path, stage: Path) -> None:
    """Write the artist's layer; the path `stage` is relative to the layer."""
    layer = Sdf.Layer.CreateNew(str(path))
    layer.subLayerPaths = [f"./{stage.as_posix()}"]
    over = Usd.Stage.Open(layer)
    channels = over.GetPrimAtPath("/Specimen/Channels")
    color = channels.GetChild("Balls").GetAttribute("inputs:color")
    color.Set(Gf.Vec3f(*COLOR))

    UsdGeom.Imageable(over.GetPrimAtPath(f"/Specimen/Tiles/{HIDDEN}")).MakeInvisible()
    moved = over.GetPrimAtPath(f"/Specimen/Tiles/{MOVED}")
    UsdGeom.XformCommonAPI(moved).SetTranslate(MOVE_UM)
    for tile, (variant_set, variant) in VARIANTS.items():
        variants = over.GetPrimAtPath(f"/Specimen/Tiles/{tile}").GetVariantSets()
        variants.SetSelection(variant_set, variant)

    functions = channels.GetChild("Sheet").GetVariantSet("transferFunction")
    functions.SetVariantSelection(FUNCTION)
    slab = channels.GetChild("Slab")
    with slab.GetVariantSet("transferFunction").GetVariantEditContext():
        slab.GetAttribute("stereocell:opacityPoints").Set([Gf.Vec2f(*p) for p in OPACITY_POINTS])
    layer.Save()
