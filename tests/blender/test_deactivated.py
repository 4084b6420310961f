"""The Blender add-on imports a stage with a deactivated part, and exports edits over it."""

from pathlib import Path

import pytest

from stereocell.usd.validate import validate_stage
from support.blender_session import NEEDS_BLENDER, run
from support.deactivated import PARTS, deactivate
from support.stages import BALL_ID, F_ID, write_whole

pytestmark = NEEDS_BLENDER


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


@pytest.mark.parametrize("part", PARTS)
def test_edits_are_exported_over_a_stage_with_a_deactivated_part(
    stage_path: Path, tmp_path: Path, part: str
) -> None:
    layer = deactivate(part, tmp_path / "edited.usda", stage_path)
    overlay = tmp_path / "overlay.usda"
    color = [BALL_ID, [0.25, 0.5, 0.75]]
    found = run(
        "edit", tmp_path, stage=layer, overlay=overlay, representation="both", lod="lod0",
        color=color,
        odd=[],
    )  # fmt: skip
    ((kind, message),) = found["messages"]
    assert kind == "Info", message
    assert f"{BALL_ID}: colour" in message
    assert F_ID not in message
    assert validate_stage(overlay) == []
