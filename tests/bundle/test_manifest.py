"""The manifest of a bundle names its source, and commands refuse it after a change."""

from pathlib import Path

import pytest
from pxr import Sdf

from stereocell.bundle.manifest import read_manifest
from stereocell.cli.__main__ import main
from stereocell.engine.run import Engine
from stereocell.model.errors import OutputError
from stereocell.notebook.bundle_files import NotebookBundle
from stereocell.serve.brick_library import BrickLibrary
from support import plain_bundle
from support.bundles import write_bundle, write_tiles
from support.stages import HEAD

FIRST, SECOND = "ab" * 32, "cd" * 32


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tiles(tmp_path_factory.mktemp("stage"))


def _state(layer_file: Path, fingerprint: object) -> None:
    layer = Sdf.Layer.FindOrOpen(str(layer_file))
    layer.customLayerData = {"stereocell": {"fingerprint": fingerprint}}
    layer.Save()


def _over(stage: Path, place: Path) -> Path:
    """Write an artist's layer over a stage; the layer states no source."""
    place.write_text(f"{HEAD}subLayers = [@{stage}@]\n)\n")
    return place


def _fingerprint(stage: Path, place: Path) -> str:
    write_bundle(stage, place, None, engine=Engine(0))
    return str(read_manifest(place)["specimen"].get("fingerprint", "not stated"))


def test_manifest_states_the_fingerprint_of_the_source_below_all_layers(
    stage: Path, tmp_path: Path
) -> None:
    for stated, expected in ((FIRST, FIRST), ("Jane Doe", "not stated"), (7, "not stated")):
        _state(stage, stated)
        over = _over(stage, tmp_path / f"over {expected[:3]}{stated}.usda")
        assert _fingerprint(over, tmp_path / "bundle") == expected
    _state(stage, FIRST)
    over = _over(stage, tmp_path / "two.usda")
    _state(over, SECOND)  # a composition of two builds belongs to neither
    both = _fingerprint(over, tmp_path / "bundle")
    assert len(both) == 64
    assert both not in (FIRST, SECOND)
    assert _fingerprint(over, tmp_path / "again") == both


@pytest.mark.parametrize("seal", ["changed", "missing"])
def test_changed_manifest_is_refused_by_every_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], seal: str
) -> None:
    plain_bundle.write(tmp_path, plain_bundle.FILES)
    bundle = tmp_path / "bundle"
    file = bundle / "manifest.json"
    words = "damaged or changed by hand"
    if seal == "changed":
        file.write_text(file.read_text("utf-8").replace('"modality": ""', '"modality": "CT"'))
    else:
        words = "found no hash of its content"
        file.write_text(file.read_text("utf-8").replace('"sha256": "', '"sha255": "'))
    for read in (
        lambda: NotebookBundle(bundle),
        lambda: BrickLibrary(bundle, tmp_path / "bricks").volumes(),
    ):
        with pytest.raises(OutputError, match=words):
            read()
    for command in (
        ["serve", str(tmp_path), "--port", "0"],
        ["view", str(bundle), "--port", "0", "--no-browser"],
        ["publish", str(bundle), str(tmp_path / "site")],
    ):
        assert main(command) == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert f"{file}: {words}" in line
        assert "run `stereocell bundle " in line
