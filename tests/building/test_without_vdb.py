"""A stage without .vdb files is smaller, valid, and gives the same bundle."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdVol

from stereocell.cli.__main__ import main
from stereocell.formats.exr import read_atlas, write_atlas
from stereocell.usd.validate import validate_stage
from support import phantoms
from support.bundles import files


def built(folder: Path, *flags: str) -> Path:
    spacing = (1.0, 1.0, 1.0)
    ball = phantoms.blurred_ball((24, 24, 24), spacing, (12.0, 12.0, 12.0), 8.0, 1.0)
    source, out = folder / "ball.ome.tif", folder / "out"
    voxels = phantoms.as_counts(ball, 100, 1100)[np.newaxis]
    folder.mkdir()
    phantoms.write_ome_tiff(source, voxels, "CZYX", spacing, names=["body"])
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    for phase in ("units", "stage", "bundle"):
        assert main([phase, str(out), "--workers", "0"]) == 0
    return out


def test_volumes_stay_in_the_bundle_and_the_stage_has_no_vdb_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = built(tmp_path / "whole")
    assert "volumes for other programs (.vdb)" in capsys.readouterr().err
    small = built(tmp_path / "small", "--without-vdb")
    assert "(.vdb)" not in capsys.readouterr().err
    assert list((whole / "stage").rglob("*.vdb"))
    assert not list((small / "stage").rglob("*.vdb"))
    assert validate_stage(small / "stage/stage.usda") == []
    stage = Usd.Stage.Open(str(small / "stage/stage.usda"))
    tile = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0")
    tile.GetVariantSet("representation").SetVariantSelection("volume")
    volume = UsdVol.Volume.Get(stage, "/Specimen/Tiles/r0_c0/body/body_r0_c0_volume")
    assert volume
    assert volume.GetFieldPaths() == {}
    one, other = (
        {path: data for path, data in files(out / "bundle").items() if path.suffix == ".ktx2"}
        for out in (whole, small)
    )
    assert one
    assert one == other


def test_a_deep_check_passes_and_still_compares_the_voxels(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = built(tmp_path / "small", "--without-vdb")
    assert main(["check", str(out), "--deep"]) == 0
    assert "volumes equal" in capsys.readouterr().out
    (atlas,) = (out / "stage/tiles").rglob("*.exr")
    voxels = read_atlas(atlas)
    voxels[10, 10, 10] ^= 1
    write_atlas(atlas, voxels)
    assert main(["check", str(out), "--deep"]) == 1
    assert "1 of 17576 voxels differ from the source's" in capsys.readouterr().out


def test_a_new_window_is_applied_to_the_voxels_of_eight_bits(tmp_path: Path) -> None:
    out = built(tmp_path / "small", "--without-vdb")
    layer = tmp_path / "edited.usda"
    window = 'over "body"\n{\nfloat2 stereocell:window = (300, 900)\n}'
    layer.write_text(
        f'#usda 1.0\n(\nmetersPerUnit = 0.000001\nupAxis = "Y"\n'
        f"subLayers = [@{out}/stage/stage.usda@]\n)\n"
        f'over "Specimen"\n{{\nover "Channels"\n{{\n{window}\n}}\n}}\n'
    )
    before = {path: data for path, data in files(out / "bundle").items() if path.suffix == ".ktx2"}
    assert main(["bundle", str(out), "--stage", str(layer), "--workers", "0"]) == 0
    after = files(out / "bundle")
    assert any(after[path] != data for path, data in before.items() if path in after)
