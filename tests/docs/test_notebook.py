"""The documentation as a site: built strictly, with the notebook run and its pictures in it."""

import base64
import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from stereocell.storage.assets import viewer_dist

ROOT = Path(__file__).parents[2]
NOTEBOOK = ROOT / "docs" / "notebook.ipynb"
SHOWN = ROOT / "docs" / "jupyter.ipynb"


def test_the_notebook_is_stored_without_outputs() -> None:
    """A diff of it can then be read, and the site shows the results of this version."""
    cells = json.loads(NOTEBOOK.read_text("utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert len(code) > 6
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in code)


def outputs(notebook: Any) -> list[dict[str, Any]]:
    """Return all that was shown, by media type; what was printed as text/plain."""
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    shown = [output for cell in cells for output in cell["outputs"]]
    return [one.get("data") or {"text/plain": one.get("text")} for one in shown]


def pictures(notebook: Any) -> list[NDArray[np.uint8]]:
    found = [data["image/png"] for data in outputs(notebook) if "image/png" in data]
    return [
        np.asarray(Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")) for png in found
    ]


def test_the_viewer_s_notebook_is_stored_with_its_pictures_and_no_more() -> None:
    text = SHOWN.read_text("utf-8")
    notebook = json.loads(text)
    assert [picture.std() > 10 for picture in pictures(notebook)] == [True, True]
    assert all(cell["execution_count"] for cell in notebook["cells"] if cell["cell_type"] == "code")
    assert "widgets" not in notebook["metadata"]
    assert not any("stderr" in str(data) or "text/html" in data for data in outputs(notebook))
    assert str(ROOT) not in text
    assert len(text) < 400_000


@pytest.mark.exhaustive
@pytest.mark.skipif(viewer_dist() is None, reason="the viewer is not built")
def test_the_viewer_s_notebook_gives_what_it_is_stored_with(tmp_path: Path) -> None:
    """The command `make notebook` stores it."""
    again = tmp_path / "jupyter.ipynb"
    quiet = {**os.environ, "IPYTHONDIR": str(tmp_path / "ipython"), "TMPDIR": str(tmp_path)}
    command = [sys.executable, str(ROOT / "docs" / "run_jupyter.py"), str(again)]
    answer = subprocess.run(command, env=quiet, capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr
    stored, run = json.loads(SHOWN.read_text("utf-8")), json.loads(again.read_text("utf-8"))
    for before, after in zip(pictures(stored), pictures(run), strict=True):
        assert before.shape == after.shape
        assert (
            np.abs(before.astype(int) - after).mean() < 2
        )  # out of 255: processors round differently
    # All other content is equal, except the pictures' bytes.
    for notebook in (stored, run):
        for data in outputs(notebook):
            data.pop("image/png", None)
    assert stored["cells"] == run["cells"]


@pytest.mark.slow
def test_the_site_builds_strictly_and_has_the_notebook_s_pictures(tmp_path: Path) -> None:
    site = tmp_path / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-q", "-d", str(site)]
    quiet = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "IPYTHONDIR": str(tmp_path / "ipython")}
    answer = subprocess.run(command, cwd=ROOT, env=quiet, capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr

    page = (site / "notebook.html").read_text("utf-8")
    pictures = re.findall(r'src="(notebook-\d+\.png)"', page)
    assert len(pictures) == 5
    assert all((site / name).stat().st_size > 5000 for name in pictures)
    # The cells found that every mesh on the page is sound, and that the iso-value is sure.
    assert re.findall(r"triangles, (\d+) faults", page) == ["0"] * 4
    confidence = re.search(r"confidence (\d\.\d+)", page)
    assert confidence
    assert float(confidence[1]) > 0.8
    assert "distance_um" in (site / "formats" / "units.html").read_text("utf-8")
    for file in site.rglob("*.html"):  # nothing is fetched from elsewhere
        assert not re.findall(
            r'<(?:script|img|link)[^>]+(?:src|href)="?https?:', file.read_text("utf-8")
        )
