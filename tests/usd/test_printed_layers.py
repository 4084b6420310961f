"""Each layer that README.md and docs/ print is valid, has the stage's units, and can be bundled."""

from pathlib import Path

import pytest

from stereocell.engine.run import Engine
from stereocell.usd.validate import validate_stage
from support.bundles import load, write_bundle
from support.printed_layers import find_layers, write_layer
from support.stages import F_ID, write_whole

LAYERS = find_layers()
# A MaterialX shader, which usd-core doesn't know: see usd/test_volume_material.py
UNKNOWN_SHADERS = {"usdShadeValidators:ShaderSdrCompliance.MissingShaderIdInRegistry"}


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


def test_layers_are_found() -> None:
    pages = {place.partition(":")[0] for place in LAYERS}
    assert {"docs/blender.md", "docs/stage-layers.md", "docs/transfer-functions.md"} <= pages


@pytest.mark.parametrize("place", LAYERS)
def test_a_printed_layer_is_valid(stage_path: Path, tmp_path: Path, place: str) -> None:
    layer = write_layer(LAYERS[place], tmp_path / "edited.usda", stage_path, F_ID)
    findings = validate_stage(layer)
    expected = UNKNOWN_SHADERS if "ND_volume" in LAYERS[place] else set()
    assert {finding.rule for finding in findings} == expected, [str(one) for one in findings]


@pytest.mark.slow
@pytest.mark.parametrize("place", LAYERS)
def test_a_printed_layer_goes_into_a_bundle(stage_path: Path, tmp_path: Path, place: str) -> None:
    layer = write_layer(LAYERS[place], tmp_path / "edited.usda", stage_path, F_ID)
    lines: list[str] = []
    write_bundle(layer, tmp_path / "bundle", None, engine=Engine(0), report_line=lines.append)
    lost = [line for line in lines if "is not taken over" in line]
    assert bool(lost) == ("ND_volume" in LAYERS[place]), lost  # a shader for other renderers
    channel = load(tmp_path / "bundle" / "manifest.json")["channels"][0]
    if "inputs:color = " in LAYERS[place]:
        assert channel["color"] == [1, 0.1, 0.1]
    if '"sharp"' in LAYERS[place]:
        assert channel["transfer_function"] == "sharp"
        assert "sharp" in channel["transfer_functions_2d"]["names"]
