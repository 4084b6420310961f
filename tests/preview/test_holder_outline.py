"""`stereocell iso` outlines the body of a CT, and not the holder that a build leaves out."""

from pathlib import Path

import numpy as np
import pytest

from stereocell.cli.__main__ import main
from stereocell.preview import iso_value
from support import nifti_files

SHAPE = (60, 130, 130)
SPACING_MM = (3.0, 1.5, 1.5)


def test_the_share_inside_a_level_is_that_of_the_body_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(iso_value, "_LONGEST_PX", 90)
    _, y, x = (
        (grid - (n - 1) / 2) * step
        for grid, n, step in zip(np.indices(SHAPE), SHAPE, SPACING_MM, strict=True)
    )
    body = (y / 75) ** 2 + (x / 62) ** 2 < 1
    away = np.hypot(y + 17, x)
    cradle = (away > 99) & (away < 105) & (y > 35) & ~body
    hu = np.where(body, 40.0, np.where(cradle, -100.0, -1000.0))
    hu += np.random.default_rng(0).normal(0, 15, SHAPE)
    voxels = hu.round().astype(np.int16).transpose(2, 1, 0)[:, ::-1]
    source = nifti_files.write(tmp_path / "ct.nii.gz", np.diag([1.5, 1.5, 3.0, 1.0]), voxels)
    flags = ("--preset", "ct", "--channel", "0", "--tile", "r0_c0", "-o", str(tmp_path / "ct.png"))
    assert main(["iso", str(source), *flags]) == 0
    printed = capsys.readouterr().out
    assert "as no part of the body (a table, holder, pad or cable)" in printed
    row = next(line.split() for line in printed.splitlines() if " * " in line)
    inside = next(float(word.rstrip("%")) / 100 for word in row if word.endswith("%"))
    assert cradle.mean() > 0.02
    assert inside == pytest.approx(body.mean(), abs=0.2 * cradle.mean() + 0.005)
