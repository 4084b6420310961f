"""The Blender add-on imports each layer that README.md and docs/ print, at the right size."""

from pathlib import Path

import pytest

from support.blender_session import NEEDS_BLENDER, run
from support.printed_layers import find_layers, write_layer
from support.stages import F_ID, leaf, write_whole

pytestmark = NEEDS_BLENDER
LAYERS = find_layers()


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


@pytest.mark.parametrize("place", LAYERS)
def test_the_add_on_imports_a_printed_layer(stage_path: Path, tmp_path: Path, place: str) -> None:
    layer = write_layer(LAYERS[place], tmp_path / "edited.usda", stage_path, F_ID)
    found = run("import", tmp_path, stage=layer, channels="ALL")
    mesh = found["meshes"][leaf("r0_c0", F_ID)]
    height = mesh["high"][1] - mesh["low"][1]
    assert height == pytest.approx(36 * 0.25, rel=0.03)  # um
    assert found["unit"] == pytest.approx(1e-6)
