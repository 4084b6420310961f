"""`plan` prints notes on how it reads a source, and its files and the report keep them."""

import json
from pathlib import Path

import nibabel
import numpy as np
import pytest

from stereocell.cli.__main__ import main

_NOTE = (
    "unit of length: not stated, mm is assumed, as in most programs for NIfTI; --spacing-um z,y,x "
    "replaces it"
)


def _unitless(path: Path) -> str:
    """Write a ball as NIfTI whose header states no unit of length."""
    z, y, x = np.ogrid[:24, :24, :24]
    ball = ((z - 12) ** 2 + (y - 12) ** 2 + (x - 12) ** 2 < 64) * np.float32(100)
    nibabel.save(nibabel.Nifti1Image(ball, np.eye(4)), path)
    return str(path)


def test_notes_of_the_reader_are_printed_and_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["build", _unitless(tmp_path / "ball.nii"), "-o", str(out)]) == 0
    assert _NOTE in " ".join(capsys.readouterr().err.split())
    for name in ("plan.json", "provenance.json"):
        assert _NOTE in json.loads((out / name).read_text("utf-8"))["notes"]
    assert _NOTE in (out / "report" / "index.html").read_text("utf-8")
    stage = (out / "stage" / "stage.usda").read_text("utf-8")
    assert _NOTE not in stage


_CHOICE = (
    "preset mri: voxels of 1 mm, no Hounsfield units, and no modality is stated: MR is assumed"
)
_SHIFTED = "values like Hounsfield units plus 1024, and its iso-value of 300 is meant for"
_IGNORED = (
    "NIfTI: the settings state its iso-value, so all tiles have the same one, and --iso-scope tile"
)


def _head(path: Path, air: float, tissue: float) -> str:
    """Write a ball of 18 mm in a cube of 28 mm as NIfTI, which states no modality."""
    z, y, x = np.ogrid[:28, :28, :28]
    is_head = (z - 14) ** 2 + (y - 14) ** 2 + (x - 14) ** 2 < 81
    noise = np.random.default_rng(0).normal(0, 4, is_head.shape)
    image = nibabel.Nifti1Image(
        (np.where(is_head, tissue, air) + noise).astype(np.int16), np.eye(4)
    )
    image.header.set_xyzt_units("mm")
    nibabel.save(image, path)
    return str(path)


@pytest.mark.parametrize(
    ("values", "flags", "note"),
    [
        ((20, 400), [], _CHOICE),
        ((20, 400), [], "for a CT --preset ct --iso-value 0="),
        ((-1000, 40), [], "preset ct: voxels of 1 mm and values like Hounsfield units"),
        ((24, 1064), ["--preset", "ct-bone"], _SHIFTED),
        ((20, 400), ["--preset", "none", "--iso-value", "0=200", "--iso-scope", "tile"], _IGNORED),
    ],
    ids=[
        "assumed MR",
        "advice for a CT",
        "recognised CT",
        "preset that does not fit",
        "ignored flag",
    ],
)
def test_notes_on_the_modality_and_on_flags_that_do_not_fit_are_kept(
    tmp_path: Path, values: tuple[float, float], flags: list[str], note: str
) -> None:
    out = tmp_path / "out"
    assert main(["plan", _head(tmp_path / "head.nii", *values), "-o", str(out), *flags]) == 0
    for name in ("plan.json", "provenance.json"):
        notes = json.loads((out / name).read_text("utf-8"))["notes"]
        assert sum(note in one for one in notes) == 1
