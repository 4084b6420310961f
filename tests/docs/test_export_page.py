"""The page on export has the command's endings, and what it says of voxels in glTF holds."""

import re
from pathlib import Path

import pytest

from stereocell.export.endings import TAKES

PAGE = Path(__file__).parents[2] / "docs" / "export-formats.md"


def test_the_table_of_endings_is_that_of_the_command() -> None:
    text = PAGE.read_text("utf-8")
    rows = text.partition("| ending |")[2].partition("\n\n")[0].splitlines()
    first_cells = [row.split("|")[1] for row in rows if row.startswith("|")]
    found = [ending for cell in first_cells for ending in re.findall(r"`(\.[\w.]+)`", cell)]
    assert sorted(found) == sorted(TAKES)


def test_no_installed_viewer_reads_voxels_of_gltf() -> None:
    """Where one does, it is time to write them: then this test and the page's section change."""
    modules = Path(__file__).parents[2] / "viewer_gltf" / "node_modules"
    readers = {
        "Cesium": modules / "@cesium/engine/Source/Scene",
        "three.js": modules / "three/examples/jsm/loaders",
    }
    for name, folder in readers.items():
        if not folder.is_dir():
            pytest.skip(f"{name} is missing: make setup")
        texts = [file.read_text("utf-8") for file in folder.rglob("*.js")]
        assert any("KHR_texture_transform" in text for text in texts), name  # the right folder
        assert not any("EXT_voxels" in text for text in texts), name
