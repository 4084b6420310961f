"""A build on object storage reads no file that it did not fetch."""

from pathlib import Path

import numpy as np
import pytest

from stereocell.cli.__main__ import main
from support import phantoms
from support.stored_out import emptied, objects_in

SHAPE = (16, 24, 48)
OF_THE_RUN = ("phases.json", "seconds.json")  # files that hold seconds


def _source(folder: Path) -> tuple[str, ...]:
    """Write an image and a label map, and return the command's arguments."""
    field = phantoms.blurred_ball(SHAPE, (1, 1, 1), (8, 12, 24), 6.0, 1.0)
    image, labels = folder / "i.ome.tif", folder / "l.ome.tif"
    phantoms.write_ome_tiff(image, phantoms.as_counts(field, 100, 1100, noise=5.0), "ZYX")
    phantoms.write_ome_tiff(labels, (field > 0.5).astype(np.uint16), "ZYX")
    return str(image), "--grid", "2x1", "--labels", f"cells={labels}"


def _build(out: str, *source: str) -> None:
    """Run each phase as a command of its own, without the files of the previous one."""
    assert main(["plan", *source, "-o", out]) == 0
    for phase in ("units", "stage", "bundle"):
        assert main([phase, out, "--workers", "0"]) == 0


@pytest.mark.slow
def test_a_build_on_object_storage_has_the_bytes_of_a_local_one_and_leaves_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, local = _source(tmp_path), tmp_path / "out"
    _build(str(local), *source)
    files = {file.relative_to(local).as_posix(): file for file in local.rglob("*")}
    here = {name: file.read_bytes() for name, file in files.items() if file.is_file()}
    with emptied() as address:
        _build(address, *source)
        there = objects_in(address)
        assert there.keys() == here.keys()
        assert [name for name in here if there[name] != here[name] and not _of_the_run(name)] == []
        assert main(["report", address]) == 0
        capsys.readouterr()
        _build(address, *source)
        printed = capsys.readouterr().err
        assert [f"{name}: up to date" in printed for name in ("units", "stage", "bundle")] == [
            True
        ] * 3


def _of_the_run(name: str) -> bool:
    return name.endswith(OF_THE_RUN)
