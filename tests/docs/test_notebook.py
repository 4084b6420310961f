"""The documentation as a site: built strictly, with the notebook run and its pictures in it."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOK = ROOT / "docs" / "notebook.ipynb"


def test_the_notebook_is_stored_without_outputs() -> None:
    """So that a diff of it reads, and what is shown is what this version does."""
    cells = json.loads(NOTEBOOK.read_text())["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert len(code) > 6
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in code)


@pytest.mark.slow
def test_the_site_builds_strictly_and_has_the_notebook_s_pictures(tmp_path: Path) -> None:
    site = tmp_path / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-q", "-d", str(site)]
    quiet = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "IPYTHONDIR": str(tmp_path / "ipython")}
    answer = subprocess.run(command, cwd=ROOT, env=quiet, capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr

    page = (site / "notebook.html").read_text()
    pictures = re.findall(r'src="(notebook-\d+\.png)"', page)
    assert len(pictures) == 5
    assert all((site / name).stat().st_size > 5000 for name in pictures)
    # what the cells found: every mesh on the page is sound, and the iso-value is sure
    assert re.findall(r"triangles, (\d+) faults", page) == ["0"] * 4
    confidence = re.search(r"confidence (\d\.\d+)", page)
    assert confidence
    assert float(confidence[1]) > 0.8
    assert "distance_um" in (site / "formats" / "units.html").read_text()
    for file in site.rglob("*.html"):  # nothing is fetched from elsewhere
        assert not re.findall(r'<(?:script|img|link)[^>]+(?:src|href)="?https?:', file.read_text())
