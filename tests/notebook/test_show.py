"""From an array to a viewer: a whole build."""

import io
import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import stereocell
from stereocell.notebook import arrays

pytestmark = pytest.mark.slow

BALLS = """
import numpy as np, stereocell
z, y, x = np.ogrid[:24, :48, :48]
r = np.sqrt((2 * (z - 12)) ** 2 + (y - 24) ** 2 + (x - 24) ** 2)
ball = (900 / (1 + np.exp(r - 15)) + 100).astype(np.uint16)
"""


def test_an_array_is_built_and_has_a_picture(built_page, tmp_path, monkeypatch, capsys):
    made: dict = {}
    exec(BALLS, made)
    monkeypatch.setattr(arrays, "MOST_VOXELS", 20_000)
    monkeypatch.setattr(arrays.find_blocks, "__defaults__", (20_000,))
    stack = np.stack([made["ball"], made["ball"][::-1]])
    out = tmp_path / "out"
    viewer = stereocell.show(
        stack, spacing_um=(0.5, 0.25, 0.25), channels=["DNA", "CD3"], name="ball", out=out
    )
    assert viewer._files.channels == ["DNA", "CD3"]
    assert viewer.quality.startswith("means of 1 x 3 x 3 voxels (z, y, x): the array has 110,592")
    assert "24 x 16 x 16 voxels" in viewer.told
    assert capsys.readouterr() == ("", "")  # a notebook is no log
    picture = np.asarray(Image.open(io.BytesIO(viewer._draw())).convert("RGB"))
    assert picture.shape[1] == 800
    assert picture.max() > 100
    # shown again from its folder, which stays, with nothing built
    assert stereocell.show(out).name == viewer.name


def test_a_build_that_nobody_keeps_goes_when_python_ends(built_page, tmp_path):
    code = BALLS + (
        "from stereocell.notebook import page\n"
        f"from pathlib import Path; page.viewer_dist = lambda: Path({str(built_page)!r})\n"
        "import tempfile; viewer = stereocell.show(ball, spacing_um=(.5, .25, .25))\n"
        "print(viewer._files.answer('manifest.json')[0])\n"
        "print(len(list(Path(tempfile.gettempdir()).iterdir())))"
    )
    place = tmp_path / "temporary"
    place.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={**os.environ, "TMPDIR": str(place)},
    )
    assert done.stdout == "200\n1\n", done.stderr
    assert not list(place.iterdir())
