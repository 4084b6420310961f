"""The stage's cameras frame the visible content, as the viewer does."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom

from stereocell.usd.cameras import define_cameras
from stereocell.usd.layer import ROOT, new_stage
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from support.stages import BALL_ID, EMPTY_ID, SHAPE, SPACING_UM, leaf, make_appearances, make_tiles

BALL_UM = (4.5, -8.0, 4.0)  # middle of the ball in the world


def write_showing(folder: Path, *shown: str) -> Usd.Stage:
    """Write the stage of support/stages.py with some of its channels shown."""
    tiles = make_tiles()
    for tile in tiles:
        write_tile(folder, tile)
    write_stage(
        folder,
        "F",
        appearances=[replace(one, opens=one.id in shown) for one in make_appearances()],
        tiles=[TileExtent.of(tile) for tile in tiles],
        provenance={},
    )
    return Usd.Stage.Open(str(folder / "stage.usda"))


def mono_of(stage: Usd.Stage) -> Gf.Camera:
    return UsdGeom.Camera.Get(stage, "/Specimen/Cameras/mono").GetCamera()


def on_screen(camera: Gf.Camera, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where points lie in the picture, from -1 to 1 in both directions."""
    to_screen = camera.frustum.ComputeViewMatrix() * camera.frustum.ComputeProjectionMatrix()
    return np.array([to_screen.Transform(Gf.Vec3d(*point))[:2] for point in points.tolist()])


def test_a_small_surface_in_a_large_box_fills_the_picture(tmp_path: Path) -> None:
    stage = write_showing(tmp_path, BALL_ID)
    parts = [stage.GetPrimAtPath(leaf(tile, BALL_ID)) for tile in ("r0_c0", "r0_c1")]
    points = np.concatenate(
        [np.array(UsdGeom.Mesh(part).GetPointsAttr().Get() or np.zeros((0, 3))) for part in parts]
    ).astype(np.float64)
    camera = mono_of(stage)
    assert camera.transform.ExtractTranslation()[:2] == pytest.approx(BALL_UM[:2], abs=0.3)
    reach = np.abs(on_screen(camera, points)).max()
    assert 0.7 < reach <= 1


def test_visible_volume_without_a_surface_is_framed_whole(tmp_path: Path) -> None:
    """The whole box is framed, because it is unknown where the volume has visible voxels."""
    camera = mono_of(write_showing(tmp_path, BALL_ID, EMPTY_ID))
    depth, height, width = np.array(SPACING_UM) * (np.array(SHAPE) - 1)
    corners = np.array([(x, -y, depth) for x in (0, width) for y in (0, height)])
    reach = np.abs(on_screen(camera, corners)).max()
    assert 0.8 < reach <= 1


def test_the_eye_stands_in_front_of_the_whole_box() -> None:
    """The framed content is only a speck, but volumes fill their whole box."""
    stage = new_stage(".usda", ROOT.name)
    box = np.array([[0.0, 0.0, 0.0], [100.0, 100.0, 100.0]])
    define_cameras(stage, box, np.array([[49.0, 49.0, 49.0], [51.0, 51.0, 51.0]]))
    eye = mono_of(stage).transform.ExtractTranslation()
    assert tuple(eye)[:2] == pytest.approx((50, 50))
    assert eye[2] > 100
