"""`plan` prints the notes on how a source is read; its files and the report keep them."""

import json
from pathlib import Path

import nibabel
import numpy as np
import pytest

from stereocell.cli.__main__ import main

_NOTE = (
    "unit of length: not stated, mm is assumed, as most programs of NIfTI do; --spacing-um z,y,x "
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
