"""The stage keeps voxels as measured, so an artist's window loses no values in the bundle."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd

from stereocell.engine.run import Engine
from support.bundles import files, write_bundle
from support.phantoms import f_phantom, write_ome_tiff
from support.validators import make_assets

SPACING_UM = (0.5, 0.25, 0.25)
WINDOW = (-310, -290)  # as narrow as one and a half 8-bit steps of the built window


def counts() -> NDArray[np.int16]:
    """Return an F with value 600 in noise round -300; like a CT, it has values below 0."""
    noise = np.random.default_rng(4).normal(-300, 8, f_phantom().shape)
    return np.where(f_phantom() > 500, 600, np.rint(noise)).astype(np.int16)


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("source") / "f.ome.tif"
    return write_ome_tiff(path, counts(), spacing=SPACING_UM, names=["F"])


def build(source: Path, out: Path, *flags: str) -> Path:
    arguments = ("--iso-value", "F=150", "--preset", "none", *flags)
    assert make_assets(source, out, "2x1", "--workers", "0", plan=arguments) == 0
    return out


@pytest.fixture(scope="module")
def built(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(source, tmp_path_factory.mktemp("built") / "out")


def bundle_over(out: Path, folder: Path) -> Path:
    """Return the bundle of a layer over the stage that sets the window."""
    folder.mkdir(exist_ok=True)
    layer = Sdf.Layer.CreateNew(str(folder / "edit.usda"))
    layer.subLayerPaths = [str(out / "stage/stage.usda")]
    stage = Usd.Stage.Open(layer)
    stage.GetAttributeAtPath("/Specimen/Channels/F.stereocell:window").Set(Gf.Vec2f(*WINDOW))
    layer.Save()
    write_bundle(folder / "edit.usda", folder / "bundle", None, engine=Engine(0))
    return folder / "bundle"


def volumes(bundle: Path) -> dict[Path, Any]:
    return {path: data for path, data in files(bundle).items() if path.parts[0] == "volumes"}


@pytest.mark.slow
def test_an_edited_window_gives_the_volumes_of_a_build_with_it(
    built: Path, source: Path, tmp_path: Path
) -> None:
    edited = bundle_over(built, tmp_path)
    low, high = WINDOW
    direct = build(source, tmp_path / "direct", "--window", f"F={low}:{high}") / "bundle"
    assert len(volumes(edited)) == 4  # textures and bricks of two tiles
    assert volumes(edited) == volumes(direct)
    assert volumes(edited) != volumes(built / "bundle")


def _read(record: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(record.read_text("utf-8"))
    return content


@pytest.mark.slow
def test_8_bits_leave_out_measured_voxels_and_the_log_states_their_size(
    built: Path, source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small = build(source, tmp_path / "small", "--bits", "8")
    assert "voxels as measured" not in capsys.readouterr().err
    records = (map(_read, out.rglob("unit.json")) for out in (built, small))
    keeps = [{record["window"] is not None for record in found} for found in records]
    assert keeps == [{True}, {False}]
    kept, alone = (
        {path: data for path, data in files(out / "bundle").items() if path.suffix != ".json"}
        for out in (built, small)
    )
    assert kept == alone  # surfaces and volumes do not depend on measured voxels
    edited = bundle_over(small, tmp_path)
    assert volumes(edited) != volumes(bundle_over(built, tmp_path / "of_16"))
    build(source, tmp_path / "whole")
    printed = capsys.readouterr().err
    records = [json.loads(path.read_text("utf-8")) for path in built.glob("units/*/stage.json")]
    assert len(records) == 2
    measured = sum(record["measured_bytes"] for record in records)
    large, bare = (
        sum(file.stat().st_size for file in out.glob("stage/tiles/*/F.vdb"))
        for out in (built, small)
    )
    # The rest is the head of each grid: its name, type and offsets.
    assert 0 < large - bare - measured < 200
    assert f"stage: {measured / 1e6:.1f} of " in printed
    assert "--bits 8 leaves them out" in printed
