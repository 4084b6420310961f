"""Storm, the renderer that ships with USD, draws the stage lit by the stage's own lights.

`make test-blender` runs these tests: Blender's Python has USD with Storm. See blender/storm.py.
"""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from support.blender_session import NEEDS_BLENDER, PYTHON
from support.stages import F_ID, HEAD, write_whole

SCRIPT = Path(__file__).with_name("storm.py")
pytestmark = NEEDS_BLENDER


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


def draw(stage: Path, picture: Path) -> NDArray[np.float64]:
    """Return the pixels (n, 3) that the specimen covers, sRGB from 0 to 1."""
    command = [PYTHON, SCRIPT, stage, "/Specimen/Cameras/mono", picture, "320"]
    drawn = subprocess.run(command, capture_output=True, text=True, timeout=120)
    if drawn.returncode and "EGL" in drawn.stderr and not os.environ.get("CI"):
        pytest.skip("EGL has no OpenGL 4.5 here: on Debian install libegl-mesa0 libgl1-mesa-dri")
    assert drawn.returncode == 0, drawn.stderr[-2000:]
    image = np.asarray(Image.open(picture).convert("RGBA")) / 255
    covered = image[image[..., 3] > 0.5]
    assert len(covered) > 1000
    return covered[:, :3]


def edit(stage: Path, layer: Path, body: str) -> Path:
    layer.write_text(f'{HEAD}subLayers = [@{stage}@])\nover "Specimen"\n{{\n{body}\n}}\n')
    return layer


def luminance(pixels: NDArray[np.float64]) -> float:
    return float((pixels @ [0.2126, 0.7152, 0.0722]).mean())


def test_the_specimen_is_neither_black_nor_white_in_its_own_lights(
    stage_path: Path, tmp_path: Path
) -> None:
    lit = draw(stage_path, tmp_path / "lit.png")
    assert 0.15 < luminance(lit) < 0.7
    assert (lit >= 1).all(axis=1).mean() < 0.01  # only highlights are white
    dark = edit(stage_path, tmp_path / "dark.usda", 'over "Lights" (active = false)\n{\n}')
    assert luminance(draw(dark, tmp_path / "dark.png")) < 0.05


def test_an_edited_channel_is_drawn_in_its_new_colour(stage_path: Path, tmp_path: Path) -> None:
    """An edit of one material's interface changes the colour in all tiles."""
    color = f'over "{F_ID}"\n{{\ncolor3f inputs:color = (0.05, 0.8, 0.1)\n}}'
    layer = edit(stage_path, tmp_path / "e.usda", f'over "Channels"\n{{\n{color}\n}}')
    before, after = draw(stage_path, tmp_path / "a.png"), draw(layer, tmp_path / "b.png")

    def is_green(pixels: NDArray[np.float64]) -> NDArray[np.bool_]:
        return (pixels[:, 1] > 1.5 * pixels[:, 0]) & (pixels[:, 1] > 1.5 * pixels[:, 2])

    assert is_green(before).mean() < 0.01
    assert is_green(after).mean() > 0.5
