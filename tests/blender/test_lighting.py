"""After an import by the add-on, the scene is ready for rendering, unless `is_lit` is off."""

from pathlib import Path

import pytest

from support.blender_session import NEEDS_BLENDER, run
from support.stages import HEAD, write_whole

pytestmark = NEEDS_BLENDER


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


def test_the_scene_has_the_lights_of_the_stage(stage_path: Path, tmp_path: Path) -> None:
    found = run("lighting", tmp_path, stage=stage_path)
    # USD's normalized intensity is an irradiance, and so is the strength of a sun in Blender.
    assert found["suns"] == pytest.approx({"key": 0.5, "fill": 0.15})
    assert found["images"] == ["studio.exr"]
    assert found["transform"] == "Standard"
    assert found["camera"] == "mono"
    assert not found["eyes"]
    assert found["hidden"] == ["Cube", "Light"]
    (color,) = found["backdrop"]
    assert max(color) < 0.01


def test_volumes_are_drawn_by_cycles(stage_path: Path, tmp_path: Path) -> None:
    assert run("lighting", tmp_path, stage=stage_path)["engine"] != "CYCLES"
    found = run("lighting", tmp_path, stage=stage_path, representation="volume")
    assert found["engine"] == "CYCLES"


def test_an_option_leaves_lights_and_settings_as_they_are(stage_path: Path, tmp_path: Path) -> None:
    found = run("lighting", tmp_path, stage=stage_path, representation="volume", is_lit=False)
    assert found["suns"] == {}
    assert found["has_own_world"]
    assert found["worlds"] == 1
    assert found["images"] == []
    assert found["transform"] == "AgX"
    assert found["engine"] != "CYCLES"
    assert found["hidden"] == []


def test_a_stage_without_a_dome_leaves_the_world(stage_path: Path, tmp_path: Path) -> None:
    layer = tmp_path / "edit.usda"
    lights = 'over "Lights"\n{\nover "dome" (active = false)\n{\n}\n}'
    layer.write_text(f'{HEAD}subLayers = [@{stage_path}@])\nover "Specimen"\n{{\n{lights}\n}}\n')
    found = run("lighting", tmp_path, stage=layer)
    assert found["has_own_world"]
    assert found["worlds"] == 1
    assert found["suns"] == pytest.approx({"key": 0.5, "fill": 0.15})


def test_both_eyes_are_rendered_by_choice(stage_path: Path, tmp_path: Path) -> None:
    assert run("lighting", tmp_path, stage=stage_path, is_stereo=True)["eyes"]
