"""The pages on architecture have the layers that `make lint` checks, and name existing packages."""

import re
import tomllib
from itertools import groupby
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PYTHON = ROOT / "pipeline" / "stereocell"
VIEWER = ROOT / "viewer_gltf" / "src"


def pictures(page: str) -> list[str]:
    return re.findall(r"^```\n(.*?)^```", (DOCS / page).read_text("utf-8"), re.M | re.S)


PYTHON_LAYERS, VIEWER_LAYERS = pictures("architecture.md")
(WAY,) = pictures("data-flow.md")


def names(picture: str) -> list[str]:
    """Return the packages of a picture, from the top: the words in its left column."""
    lines = [line[:40] for line in picture.splitlines() if not line.startswith(" ---")]
    return [name for line in lines for name in line.split()]


def table(page: str) -> list[str]:
    return re.findall(r"^\| `(\w+)` \|", (DOCS / page).read_text("utf-8"), re.M)


def test_the_picture_has_the_layers_of_python_that_lint_checks() -> None:
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]
    (layers,) = [c["layers"] for c in tool["contracts"] if c["type"] == "layers"]
    assert names(PYTHON_LAYERS) == layers


def test_the_picture_has_the_layers_of_the_viewer_that_lint_checks() -> None:
    code = (ROOT / "viewer_gltf" / "scripts" / "layers.ts").read_text("utf-8")
    layers = [one.strip('"').lower() for one in re.findall(r'^  ("\w+"|PARTS),$', code, re.M)]
    parts = {file.parent.name for file in VIEWER.glob("*/part.ts")} - set(layers)
    shown = names(VIEWER_LAYERS)
    assert parts < set(shown)
    in_layers = ["parts" if name in parts else name for name in shown]
    assert [name for name, _ in groupby(in_layers)] == layers[::-1]


@pytest.mark.parametrize(
    ("page", "folder"), [("packages.md", PYTHON), ("viewer-folders.md", VIEWER)]
)
def test_each_package_has_its_line(page: str, folder: Path) -> None:
    there = {p.name for p in folder.iterdir() if p.is_dir() and not p.name.startswith("__")}
    there |= {"api"} if folder == PYTHON else set()
    found = table(page)
    assert len(found) == len(set(found))
    assert set(found) == there


def test_the_way_of_a_tile_names_files_that_exist() -> None:
    packages = [p.name for p in (*PYTHON.iterdir(), *VIEWER.iterdir()) if p.is_dir()]
    steps = re.findall(rf"\b(?:{'|'.join(packages)})/[\w/*]+", WAY)
    assert len(steps) > 15
    for step in steps:
        files = [*PYTHON.glob(f"{step}*"), *VIEWER.glob(f"{step}*")]
        made = step.startswith(("bundle/index", "units/"))  # files of a build
        assert made or files, step
