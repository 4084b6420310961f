"""Blender's own importer shows a stage with its colours and lights, without the add-on."""

from pathlib import Path

import pytest

from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from support.blender_session import NEEDS_BLENDER, run
from support.stages import BALL_ID, COLORS, F_ID, HEAD, TILES, write_whole

pytestmark = NEEDS_BLENDER


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


def test_channels_have_their_colours(stage_path: Path, tmp_path: Path) -> None:
    found = run("plain_import", tmp_path, stage=stage_path)["colors"]
    assert len(found) == 4
    for tile in TILES:
        for channel, color in zip((F_ID, BALL_ID), COLORS[:2], strict=True):
            assert found[f"{channel}_{tile}"] == pytest.approx(color, abs=1e-6)


def test_an_exported_file_has_the_colours_of_an_edit(stage_path: Path, tmp_path: Path) -> None:
    color = f'over "{F_ID}"\n{{\ncolor3f inputs:color = (0.25, 0.75, 0.5)\n}}'
    layer, flat = tmp_path / "edited.usda", tmp_path / "flat.usdc"
    body = f'over "Specimen"\n{{\nover "Channels"\n{{\n{color}\n}}\n}}\n'
    layer.write_text(f"{HEAD}subLayers = [@{stage_path}@])\n{body}")
    export_stage(layer, flat, options=ExportOptions(lod=1))
    found = run("plain_import", tmp_path, stage=flat)["colors"]
    for tile in TILES:
        assert found[f"{F_ID}_{tile}"] == pytest.approx((0.25, 0.75, 0.5), abs=1e-6)
        assert found[f"{BALL_ID}_{tile}"] == pytest.approx(COLORS[1], abs=1e-6)


def test_the_lights_and_the_image_of_the_dome_arrive(stage_path: Path, tmp_path: Path) -> None:
    found = run("plain_import", tmp_path, stage=stage_path)
    assert found["lights"] == {"key": "SUN", "fill": "SUN"}
    (image,) = found["sky"]
    assert Path(image) == stage_path.parent / "looks" / "studio.exr"
