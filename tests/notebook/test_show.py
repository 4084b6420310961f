"""From an array to a viewer: a whole build."""

import io
import os
import subprocess
import sys
import tempfile

import numpy as np
import pytest
from PIL import Image

import stereocell
from stereocell.model.errors import OutputError, UsageError
from stereocell.notebook import arrays
from support.digests import digests_of
from support.outputs import make_source

pytestmark = pytest.mark.slow

BALLS = """
import numpy as np, stereocell
z, y, x = np.ogrid[:24, :48, :48]
r = np.sqrt((2 * (z - 12)) ** 2 + (y - 24) ** 2 + (x - 24) ** 2)
ball, small = ((900 / (1 + np.exp(r - radius)) + 100).astype(np.uint16) for radius in (17, 9))
"""


@pytest.mark.usefixtures("undrawn")
def test_an_array_is_built_and_has_a_picture(built_page, tmp_path, monkeypatch, capsys):
    made: dict = {}
    exec(BALLS, made)
    monkeypatch.setattr(arrays, "MAX_VOXELS", 20_000)
    monkeypatch.setattr(arrays.find_blocks, "__kwdefaults__", {"most": 20_000})
    stack = np.stack([made["small"], made["ball"]])
    out = tmp_path / "out"
    viewer = stereocell.show(
        stack, spacing_um=(0.5, 0.25, 0.25), channels=["DNA", "CD3"], name="a ball/1", out=out
    )
    assert viewer._files.channels == ["DNA", "CD3"]
    assert viewer.quality.startswith(
        "Shows means of 1 x 3 x 3 voxels (z, y, x): the array has 110,592"
    )
    assert viewer.name == "a ball_1"
    assert "24 x 16 x 16 voxels" in viewer.notes
    assert capsys.readouterr() == ("", "")  # nothing is printed into the notebook

    def drawn(**looks):
        found = viewer._draw(looks)
        return (
            np.asarray(Image.open(io.BytesIO(found)).convert("RGB")).astype(int) if found else None
        )

    both = drawn()
    assert both.shape[1] == 640
    assert both.max() > 100
    # The image follows the channels: another colour, hidden, translucent.
    only = drawn(DNA={"color": "#ff0000"}, CD3={"visible": False})
    assert only[..., 0].max() > 2 * only[..., 2].max()
    blue = {"color": "#0000ff"}
    over = drawn(DNA={"color": "#ff0000"}, CD3=blue)
    through = drawn(DNA={"color": "#ff0000"}, CD3={"opacity": 0.25, **blue})
    middle = over.shape[0] // 2, over.shape[1] // 2
    assert over[middle][2] > 2 * over[middle][0]
    assert through[middle][0] == pytest.approx(0.75 * only[..., 0].max(), rel=0.2)
    assert through[middle][2] > 0.25 * over[middle][2] - 2
    assert drawn(DNA={"visible": False}, CD3={"opacity": 0.0}) is None
    # The folder of the build can be shown again, without building anything.
    assert stereocell.show(out).name == viewer.name


def test_a_build_in_a_temporary_folder_is_removed_when_python_ends(built_page, tmp_path):
    code = BALLS + (
        "from stereocell.bundle import blob_page\n"
        "from stereocell.report import phase; phase.run_report = lambda *_, **__: None\n"
        f"from pathlib import Path; blob_page.viewer_dist = lambda: Path({str(built_page)!r})\n"
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


@pytest.mark.parametrize(
    ("source", "more", "message"),
    [
        ("", {}, "an empty name, expected a path"),  # does not mean the working folder
        ("x.tif", {"spacing_um": 2}, "spacing_um is 2, expected z, y, x in um"),
    ],
)
def test_a_source_that_cannot_be_shown_gives_one_line(
    built_page, tmp_path, monkeypatch, source, more, message
):
    place = tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    with pytest.raises(UsageError, match=message):
        stereocell.show(source, **more)
    assert not list(place.iterdir())


def test_a_build_without_a_bundle_is_named_as_one(built_page, tmp_path):
    (tmp_path / "plan.json").write_text("{}")
    with pytest.raises(UsageError, match="a build without a bundle") as raised:
        stereocell.show(tmp_path)
    assert f"`stereocell bundle {tmp_path}`" in str(raised.value)


@pytest.mark.usefixtures("undrawn")
def test_another_array_replaces_a_build_only_by_force(built_page, tmp_path):
    made: dict = {}
    exec(BALLS, made)
    out = tmp_path / "out"
    sure = {"spacing_um": (0.5, 0.25, 0.25), "out": out}
    stereocell.show(made["small"], **sure)
    before = digests_of(out)
    stereocell.show(made["small"], **sure)  # the same array again changes nothing
    assert digests_of(out) == before
    for given in (made["ball"], str(make_source(tmp_path / "f.ome.tif"))):
        more = sure if given is made["ball"] else {"out": out}
        with pytest.raises(OutputError, match=r"force=True replaces it$"):
            stereocell.show(given, **more)
        assert digests_of(out) == before
    with pytest.raises(OutputError, match="expected nothing or a build of this array"):
        stereocell.show(made["small"], **sure, name="another")
    assert digests_of(out) == before
    assert stereocell.show(made["ball"], **sure, force=True).name == "array"
    assert digests_of(out)["array.ome.tif"] != before["array.ome.tif"]
