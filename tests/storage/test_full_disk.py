"""A disk fills up in the middle of each phase of a build, and is emptied later."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from stereocell.cli.__main__ import main
from support import phantoms
from support.digests import digests_of
from support.exhaustive import IS_EXHAUSTIVE


def _resize(disk: Path, size: str) -> None:
    subprocess.run(["mount", "-o", f"remount,size={size}", str(disk)], check=True)


@pytest.mark.slow
def test_a_full_disk_is_one_line_leaves_no_partial_file_and_the_build_goes_on_later(
    tmp_path: Path,
    small_disk: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if not IS_EXHAUSTIVE:  # drawing the report takes longest and needs little of the disk
        monkeypatch.setattr("stereocell.report.phase.run_report", lambda *_, **__: None)
    body = np.stack([phantoms.f_phantom()] * 2)
    source = phantoms.write_ome_tiff(tmp_path / "f.ome.tif", body, "CZYX", names=["a", "b"])

    def build(out: Path) -> int:
        return main(["build", str(source), "-o", str(out), "--workers", "0", "--grid", "2x1"])

    assert build(tmp_path / "undisturbed") == 0
    used = sum(f.stat().st_size for f in (tmp_path / "undisturbed").rglob("*") if f.is_file())
    capfd.readouterr()

    out = small_disk / "out"
    failures = 0
    percents = range(3, 100, 18 if IS_EXHAUSTIVE else 36)
    for percent in percents:
        _resize(small_disk, f"{used * percent // 100 // 1024 + 8}k")
        code = build(out)
        printed = capfd.readouterr().err
        assert "Traceback" not in printed
        assert not [f for f in out.rglob(".*") if f.is_file() or f.is_dir()], percent
        if code:
            failures += 1
            assert code == 1
            assert "No space left on device" in printed
    assert failures > len(percents) // 2
    _resize(small_disk, "512m")
    assert build(out) == 0
    for part in ("stage", "bundle"):
        assert digests_of(out / part) == digests_of(tmp_path / "undisturbed" / part)
