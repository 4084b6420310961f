"""Files are recognised by their first bytes if the format of their ending has a mark."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdUtils

from stereocell.storage.contents import contents_of

MARKED = (".glb", ".ply", ".3mf", ".usda", ".usdc", ".usd", ".usdz")


@pytest.mark.parametrize("ending", [*MARKED, ".GLB"])
def test_a_text_with_the_ending_of_another_format_is_reported_to_have_other_content(
    tmp_path: Path, ending: str
) -> None:
    file = tmp_path / f"mine{ending}"
    file.write_text("hi")
    assert contents_of(file).words == f"a file that is named {ending.lower()} and has other content"


@pytest.mark.parametrize("ending", [".usda", ".usdc", ".usd"])
def test_a_layer_is_recognised_as_a_usd_file(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"mine{ending}"
    Usd.Stage.CreateNew(str(file)).Save()
    assert contents_of(file).words == "a USD file"
    packed = tmp_path / "mine.usdz"
    assert UsdUtils.CreateNewUsdzPackage(str(file), str(packed))
    assert contents_of(packed).words == "a USD file"


@pytest.mark.parametrize(
    ("ending", "words"),
    [
        (".glb", "a glTF file of surfaces"),
        (".ply", "a file of surfaces"),
        (".stl", "a file of surfaces"),
        (".obj", "a file of surfaces"),
    ],
)
def test_surfaces_of_another_library_are_recognised(
    tmp_path: Path, ending: str, words: str
) -> None:
    trimesh.creation.box(np.ones(3)).export(tmp_path / f"mine{ending}")
    assert contents_of(tmp_path / f"mine{ending}").words == words


def test_an_empty_file_is_called_empty(tmp_path: Path) -> None:
    (tmp_path / "mine.glb").touch()
    assert contents_of(tmp_path / "mine.glb").words.startswith("an empty file")
