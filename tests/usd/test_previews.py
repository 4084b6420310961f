"""A stage has a thumbnail and cards of its surfaces. blender/test_cards.py draws the cards."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Usd, UsdGeom, UsdMedia

from stereocell.usd.write_previews import write_previews
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from stereocell.usd.written_files import AsWritten
from support.digests import digests_of
from support.stages import make_appearances, make_tiles, write_whole


def with_previews(folder: Path) -> Path:
    path = write_whole(folder)
    assert write_previews(folder, AsWritten({folder.resolve(): {}}))
    return path


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Usd.Stage:
    return Usd.Stage.Open(str(with_previews(tmp_path_factory.mktemp("stage"))))


@pytest.fixture
def root(stage: Usd.Stage) -> Usd.Prim:
    return stage.GetDefaultPrim()


def test_the_thumbnail_shows_the_specimen(root: Usd.Prim) -> None:
    thumbnails = UsdMedia.AssetPreviewsAPI(root).GetDefaultThumbnails()
    pixels = np.asarray(Image.open(thumbnails.defaultImage.resolvedPath)).astype(int)
    assert max(pixels.shape[:2]) == 512
    red, _, blue = np.moveaxis(pixels, -1, 0)
    assert (red > blue + 60).mean() > 0.05  # the letter
    assert (blue > red + 60).mean() > 0.02  # the ball


@pytest.mark.parametrize("side", ["XPos", "XNeg", "YPos", "YNeg", "ZPos", "ZNeg"])
def test_a_card_fills_the_box_of_its_side(root: Usd.Prim, side: str) -> None:
    model = UsdGeom.ModelAPI(root)
    assert model.GetModelCardGeometryAttr().Get() == "box"
    assert model.ComputeModelDrawMode() == "default"  # nothing is drawn as cards unless asked
    low, high = np.array(model.GetExtentsHint())
    x, y, z = high - low
    # USD's cards of the x sides have y to the right and z up
    width, height = {"X": (y, z), "Y": (x, z), "Z": (x, y)}[side[0]]
    file = root.GetAttribute(f"model:cardTexture{side}").Get().resolvedPath
    with Image.open(file) as image:
        assert image.mode == "RGBA"
        assert image.width / image.height == pytest.approx(width / height, rel=0.01)
        alpha = np.asarray(image)[..., 3]
    assert 0.2 < (alpha == 255).mean() < 0.9  # the letter and the ball leave corners empty


def test_the_same_stage_has_the_same_previews(tmp_path: Path) -> None:
    for name in ("a", "b"):
        with_previews(tmp_path / name)
    assert digests_of(tmp_path / "a") == digests_of(tmp_path / "b")


def test_a_specimen_without_surfaces_has_none(tmp_path: Path) -> None:
    tiles = [
        replace(tile, channels=tuple(replace(channel, lods=()) for channel in tile.channels))
        for tile in make_tiles()
    ]
    for tile in tiles:
        write_tile(tmp_path, tile)
    extents = [TileExtent.of(tile) for tile in tiles]
    write_stage(tmp_path, "F", appearances=make_appearances(), tiles=extents, provenance={})
    assert not write_previews(tmp_path, AsWritten({tmp_path.resolve(): {}}))
    stage = Usd.Stage.Open(str(tmp_path / "stage.usda"))
    assert "AssetPreviewsAPI" not in stage.GetDefaultPrim().GetAppliedSchemas()
    assert list((tmp_path / "previews").iterdir()) == []
