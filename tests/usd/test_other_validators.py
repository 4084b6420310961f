"""The rules of usd-validation-nvidia find no fault in stages and usdz files of the samples."""

from pathlib import Path

import pytest
import tifffile
from usd_validation_nvidia import IssueSeverity, ValidationEngine
from usd_validation_nvidia.rules import IndexedPrimvarChecker

from stereocell.cli.__main__ import main
from stereocell.samples.brain_cells import write_brain_cells
from stereocell.samples.cells import table_beside, write_cells
from stereocell.samples.head import make_head
from stereocell.samples.head_dicom import write_dicom
from support.phantoms import write_ome_tiff

# Viewers of augmented reality may ignore indices, so specimen.usdz has none.
OFF = IndexedPrimvarChecker


def small_cycif(folder: Path) -> list[str]:
    source = str(folder / "s.ome.zarr")
    assert main(["sample", "cycif", source, "--grid", "1x1", "--tile-size", "16,48,48"]) == 0
    return [source, "--preset", "cycif"]


def small_brain_cells(folder: Path) -> list[str]:
    write_brain_cells(folder / "whole.ome.tif")
    whole = tifffile.imread(folder / "whole.ome.tif")  # z, c, y, x
    crop = whole[:24, :, :64, :64].swapaxes(0, 1)
    write_ome_tiff(folder / "s.ome.tif", crop, "CZYX")
    return [str(folder / "s.ome.tif"), "--preset", "lightsheet", "--grid", "2x1"]


def small_mri(folder: Path) -> list[str]:
    write_dicom(folder / "head", make_head(shape=(24, 20, 22), seed=4), seed=4)
    return [str(folder / "head"), "--preset", "mri"]


def small_cells(folder: Path) -> list[str]:
    write_cells(folder / "s.ome.zarr", seed=2, shape=(24, 60, 60))
    table = str(table_beside(folder / "s.ome.zarr"))
    return [str(folder / "s.ome.zarr"), "--channels", "DNA", "--labels", "cells", "--table", table]


SAMPLES = {
    "cycif": small_cycif,
    "brain-cells": small_brain_cells,
    "mri": small_mri,
    "cells": small_cells,
}


@pytest.mark.slow
@pytest.mark.parametrize("sample", SAMPLES)
def test_the_rules_find_no_fault_in_a_sample(tmp_path: Path, sample: str) -> None:
    out = str(tmp_path / "out")
    assert main(["plan", *SAMPLES[sample](tmp_path), "-o", out]) == 0
    assert main(["units", out, "--workers", "0"]) == 0
    assert main(["stage", out, "--workers", "0"]) == 0
    engine = ValidationEngine()  # checks each variant by all default rules
    assert len(engine.initialized_rules) > 30
    for name in ("stage.usda", "display.usda", "specimen.usdz"):
        if name == "specimen.usdz":
            engine.disable_rule(OFF)
        file = tmp_path / "out" / "stage" / name
        assert file.is_file()
        issues = list(engine.validate(str(file)).issues())
        assert [str(issue) for issue in issues if issue.severity != IssueSeverity.INFO] == []


def test_the_rules_find_a_missing_default_prim(tmp_path: Path) -> None:
    faulty = tmp_path / "faulty.usda"
    faulty.write_text('#usda 1.0\n(upAxis = "Y")\ndef Xform "A"\n{\n}\n')
    issues = [str(issue) for issue in ValidationEngine().validate(str(faulty)).issues()]
    assert any("defaultPrim" in issue for issue in issues)
