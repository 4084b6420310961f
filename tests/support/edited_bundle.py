"""Bundles of a stage and of layers over it: `python -m support.edited_bundle FOLDER`.

The stage is that of two tiles with a sphere across their border (`support.bundles`). The layers are
made by USD's own API. A folder of each name gets a bundle.
"""

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdGeom

from support.bundles import write, write_tiles
from support.edit_cases import SURFACE, TILE, define_arrow, define_wire
from support.stages import edit_over

OPACITY = 0.4
EMISSION = (0.0, 0.4, 0.0)
TILE_NAME, ARROW_NAME = "Left half", "Here"


def _translucent(stage: Usd.Stage) -> None:
    shader = stage.OverridePrim(SURFACE)
    shader.CreateAttribute("inputs:opacity", Sdf.ValueTypeNames.Float).Set(OPACITY)


def _glowing(stage: Usd.Stage) -> None:
    shader = stage.OverridePrim(SURFACE)
    glow = shader.CreateAttribute("inputs:emissiveColor", Sdf.ValueTypeNames.Color3f)
    glow.Set(Gf.Vec3f(*EMISSION))


def _named(stage: Usd.Stage) -> None:
    stage.OverridePrim(TILE).SetDisplayName(TILE_NAME)


def _guide(stage: Usd.Stage) -> None:
    UsdGeom.Imageable(stage.OverridePrim(TILE)).CreatePurposeAttr("guide")


def _framed(stage: Usd.Stage) -> None:
    """Add two cameras that look at the sphere: one from the side, and one from the front."""
    for name, place, turn in (("side", (40, -5, 4), 90.0), ("front", (10, -5, 24), 0.0)):
        camera = UsdGeom.Camera.Define(stage, f"/Specimen/Cameras/{name}")
        camera.GetPrim().SetDisplayName(f"From the {name}")
        camera.AddTranslateOp().Set(Gf.Vec3d(*place))
        camera.AddRotateYOp().Set(turn)
        camera.CreateFocalLengthAttr(50.0)
        camera.CreateVerticalApertureAttr(20.0)


def _added(stage: Usd.Stage) -> None:
    define_arrow(stage).GetPrim().SetDisplayName(ARROW_NAME)
    define_wire(stage)


def _seen_through(stage: Usd.Stage) -> None:
    _translucent(stage)
    define_wire(stage)


LAYERS: dict[str, Callable[[Usd.Stage], object]] = {
    "built": lambda _: None,
    "translucent": _translucent,
    "glowing": _glowing,
    "named": _named,
    "guide": _guide,
    "framed": _framed,
    "added": _added,
    "seen_through": _seen_through,
}


def write_all(folder: Path) -> None:
    """Write a bundle of each layer."""
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        stage = write_tiles(Path(scratch) / "stage")
        for name, change in LAYERS.items():
            write(edit_over(Path(scratch) / f"{name}.usda", stage, change), folder / name)


if __name__ == "__main__":
    write_all(Path(sys.argv[1]))
