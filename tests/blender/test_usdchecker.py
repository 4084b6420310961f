"""The checks of `usdchecker` find no fault in a stage. Blender's USD has them; usd-core has not."""

from pathlib import Path

import pytest

from stereocell.usd.write_previews import write_previews
from stereocell.usd.written_files import AsWritten
from support.blender_session import NEEDS_BLENDER, run
from support.stages import TILES, write_whole

pytestmark = NEEDS_BLENDER

LAYERS = ("stage.usda", "contents.usda", "display.usda", "nvindex.usda")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stage")
    write_whole(folder)
    assert write_previews(folder, AsWritten({folder.resolve(): {}}))
    return folder


def test_usdchecker_finds_nothing_in_any_variant(folder: Path, tmp_path: Path) -> None:
    names = [*LAYERS, *(f"tiles/{tile}/tile.usdc" for tile in TILES)]
    found = run("usdchecker", tmp_path, stage_dir=folder, files=names)
    assert found == {name: [] for name in names}


def test_usdchecker_finds_a_missing_layer(folder: Path, tmp_path: Path) -> None:
    faulty = folder / "faulty.usda"
    faulty.write_text('#usda 1.0\n(subLayers = [@./missing.usda@])\ndef Xform "A"\n{\n}\n')
    (faults,) = run("usdchecker", tmp_path, stage_dir=folder, files=["faulty.usda"]).values()
    assert any("missing.usda" in fault for fault in faults)
