"""A table that a CT's surface leaves out is left out of its volume and the stage's voxels."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.model.tile_content import APRON
from stereocell.planning.settings import load
from stereocell.preview.iso_value import preview
from stereocell.steps.unit_files import load_voxels
from support import nifti_files
from support.validators import make_assets

SHAPE, SPACING_MM = (36, 56, 64), 3.0  # slices, rows, columns
PRESET = ("--preset", "ct-bone")
AIR, FLESH, BONE, TABLE = -1000, 40, 700, 900


def _parts() -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Return masks of body, bone and table of a chest."""
    middle = [(n - 1) / 2 for n in SHAPE]
    _, y, x = ((g - m) * SPACING_MM for g, m in zip(np.indices(SHAPE), middle, strict=True))
    body = ((y + 12) / 50) ** 2 + (x / 72) ** 2 < 1
    bone = np.hypot(y - 10, x) < 12
    table = (y > 45) & (y < 55) & (abs(x) < 85)
    return body, bone, table


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    body, bone, table = _parts()
    hu = np.select([bone, body, table], [BONE, FLESH, TABLE], AIR).astype(np.int16)
    hu += np.random.default_rng(0).integers(-12, 13, SHAPE).astype(np.int16)
    affine = np.diag([SPACING_MM, SPACING_MM, SPACING_MM, 1.0])
    place = tmp_path_factory.mktemp("chest") / "chest.nii.gz"
    return nifti_files.write(place, affine, hu.transpose(2, 1, 0))


def _voxels(out: Path) -> tuple[NDArray[np.uint8], NDArray[np.int16]]:
    """Return the unit's volume and its voxels as measured, without their apron."""
    folder = OutFolder(out)
    (name, key), *_ = folder.index().items()
    tile, channel = name.split("/")
    unit = folder.unit_dir(f"{tile}/{channel}", key)
    volume, measured = load_voxels(unit)
    assert measured is not None
    inner = slice(APRON, -APRON)
    return volume[inner, inner, inner], measured[inner, inner, inner]


def _shares(voxels: NDArray[np.int16], value: int) -> float:
    return float(np.mean(abs(voxels - value) < 40))


@pytest.mark.slow
def test_a_table_is_left_out_of_the_volume_and_a_deep_check_agrees(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    without, with_table = tmp_path / "without", tmp_path / "with"
    assert make_assets(source, without, "1x1", "--workers", "0", plan=PRESET) == 0
    printed = capsys.readouterr().err
    assert "left out, as no part of the body (a table, holder, pad or cable): " in printed
    assert "--keep-holder builds it" in printed
    assert "unsure" not in printed
    keep = (*PRESET, "--keep-holder")
    assert main(["plan", str(source), "-o", str(with_table), "--grid", "1x1", *keep]) == 0
    assert main(["units", str(with_table), "--workers", "0"]) == 0
    eight_bit, measured = _voxels(without)
    eight_bit_kept, measured_kept = _voxels(with_table)
    assert _shares(measured_kept, TABLE) > 0.03
    assert _shares(measured, TABLE) < 0.0005
    # all other voxels are as measured
    same = measured == measured_kept
    assert np.mean(same) > 0.9
    assert (measured[~same] <= AIR).all()
    assert (eight_bit[same] == eight_bit_kept[same]).all()
    assert _shares(measured, BONE) == pytest.approx(_shares(measured_kept, BONE), abs=1e-4)
    assert main(["check", str(without), "--deep", "--workers", "0"]) == 0
    (channel,) = OutFolder(without).survey().values()
    look = channel["appearance"]
    assert (look["surface"], look["surface_reason"], look["function"]) == ("clear", "", "bone")


def test_a_preview_outlines_the_body_without_the_table(source: Path, tmp_path: Path) -> None:
    body, _, table = _parts()

    def shares(name: str, **surface: bool) -> list[float]:
        settings = load("ct", None, flags={"surface": surface})
        found, _ = preview(
            str(source), "0", tile_id="r0_c0", out=tmp_path / name, settings=settings
        )
        return [one.inside for one in found.candidates if -700 < one.level < 0]

    with_table = (body | table).mean()
    assert shares("kept.png", keep_holder=True)[0] == pytest.approx(with_table, abs=0.02)
    assert shares("a.png")[0] == pytest.approx(body.mean(), abs=0.02)
    assert with_table - body.mean() > 0.04
