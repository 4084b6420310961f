"""A CT whose values are not Hounsfield units, built by the flags that the plan's note advises."""

import json
import shlex
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.model.channel import Appearance
from stereocell.transfer.ct_tissues import TISSUES
from stereocell.transfer.opacity import evaluate
from support import nifti_files

SHAPE, SPACING_MM = (20, 48, 48), 3.0  # slices, rows, columns
STAYS = "not Hounsfield units, so functions by tissue are not offered"


def _hounsfield() -> NDArray[np.float64]:
    """Return a trunk of fat, muscle and bone above a table, in air with noise."""
    _, y, x = np.indices(SHAPE)
    away = np.hypot(y - 20, x - 24)
    table = (y > 40) & (y < 44)
    parts = [away < 4, away < 13, away < 16, table]
    hu = np.select(parts, [700, 50, -100, 100], -1000).astype(float)
    return hu + np.random.default_rng(0).normal(0, 6, SHAPE)


def _shifted() -> NDArray[np.int16]:
    return (_hounsfield() + 1024).round().astype(np.int16)


def _in_8_bits() -> NDArray[np.uint8]:
    return (np.clip((_hounsfield() + 160) / 400, 0, 1) * 255).round().astype(np.uint8)


def _in_16_bits() -> NDArray[np.int16]:
    return _in_8_bits().astype(np.int16)


def _write(folder: Path, voxels: NDArray[np.generic]) -> Path:
    affine = np.diag([SPACING_MM, SPACING_MM, SPACING_MM, 1.0])
    return nifti_files.write(folder / "ct.nii.gz", affine, voxels.transpose(2, 1, 0))


def _advised_flags(printed: str) -> list[str]:
    """Return the flags that the plan advises for a CT, as a user would copy them."""
    advice = printed.partition("for a CT ")[2]
    words = shlex.split(advice.replace(";", " ").replace(", ", " "))
    last = words.index("--window") + 1
    return words[: last + 1]


def _built(source: Path, out: Path, flags: list[str]) -> Appearance:
    assert main(["plan", str(source), "-o", str(out), "--grid", "1x1", *flags]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    folder = OutFolder(out)
    (channel,) = read_survey(folder).values()
    assert channel.holder is None
    return channel.appearance


@pytest.mark.slow
@pytest.mark.parametrize("make", [_shifted, _in_8_bits, _in_16_bits])
def test_the_flags_that_are_advised_open_with_a_function_at_the_skin(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    make: Callable[[], NDArray[np.generic]],
) -> None:
    voxels = make()
    source = _write(tmp_path, voxels)
    assert main(["plan", str(source), "-o", str(tmp_path / "first")]) == 0
    flags = _advised_flags(capsys.readouterr().err.replace("\n", " "))
    look = _built(source, tmp_path / "out", flags)
    printed = capsys.readouterr().err.replace("\n", " ")
    assert STAYS in printed
    assert "a table or head holder is kept" in printed
    notes = json.loads((tmp_path / "out" / "provenance.json").read_text("utf-8"))["notes"]
    assert any(STAYS in note for note in notes)
    assert not set(look.transfer_functions) & set(TISSUES)
    assert look.function == "default"
    assert look.iso_value is not None
    # air is transparent, and fat is visible
    low, high = look.window
    opacity = evaluate(look.transfer_functions[look.function])
    air, fat = (float(np.median(voxels[where])) for where in _air_and_fat())
    of_air, of_fat = (
        opacity[round(255 * np.clip((v - low) / (high - low), 0, 1))] for v in (air, fat)
    )
    assert air < look.iso_value < fat
    assert of_air == 0 < of_fat


def _air_and_fat() -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    hu = _hounsfield()
    return hu < -900, (hu > -130) & (hu < -70)


def test_a_ct_in_hounsfield_units_keeps_its_transfer_functions_by_tissue(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = _write(tmp_path, _hounsfield().round().astype(np.int16))
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), "--preset", "ct"]) == 0
    assert "not Hounsfield units" not in capsys.readouterr().err
    assert OutFolder(tmp_path / "out").plan().is_hounsfield


def test_a_named_window_of_ct_is_refused_for_values_that_are_not_hounsfield_units(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = _write(tmp_path, _shifted())
    flags = ["--preset", "ct", "--iso-value", "0=724", "--window", "0=bone"]
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), *flags]) == 2
    assert "the values of this CT are not, expected LOW:HIGH" in capsys.readouterr().err


def _crop() -> NDArray[np.int16]:
    """Return muscle and bone without air or fat, in Hounsfield units."""
    return _hounsfield()[:, 10:31, 14:35].clip(40, None).round().astype(np.int16)


@pytest.mark.parametrize("preset", ["ct", "ct-bone"])
def test_a_crop_without_air_is_in_hounsfield_units_if_the_user_says_so(
    tmp_path: Path, preset: str, capfd: pytest.CaptureFixture[str]
) -> None:
    source = _write(tmp_path, _crop())
    command = ["plan", str(source), "-o", str(tmp_path / "out"), "--preset", preset]
    assert main(command) == 0
    assert f"{STAYS} and a table or head holder is kept (--as hounsfield" in (
        capfd.readouterr().err.replace("\n", " ")
    )
    stated = tmp_path / "stated"
    assert main([*command[:3], str(stated), *command[4:], "--as", "hounsfield"]) == 0
    assert "not Hounsfield units" not in capfd.readouterr().err
    plan = json.loads((stated / "plan.json").read_text("utf-8"))
    assert (plan["modality"], plan["is_hounsfield"]) == ("CT", True)


def test_hounsfield_units_stated_by_the_user_lead_to_the_preset_for_ct(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source = _write(tmp_path, _crop())
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), "--as", "hounsfield"]) == 0
    assert "preset ct: the values are taken for Hounsfield units" in capfd.readouterr().err
    assert json.loads((tmp_path / "out" / "plan.json").read_text("utf-8"))["modality"] == "CT"
