"""The outputs of each command for one small specimen: a build, a page, files for other programs."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from stereocell import samples
from stereocell.cli.__main__ import main
from stereocell.samples.head import make_head
from stereocell.samples.head_dicom import write_dicom
from support import phantoms

# Endings that are exported once each. Films are left out: they take long.
EXPORTS = (".glb", ".stl", ".obj", ".usda", ".usdz", ".png", ".nrrd", ".nii.gz", ".raw", ".html")


@dataclass(frozen=True, slots=True)
class Outputs:
    """The outputs' paths by their names, and the volume that all are made of."""

    source: Path
    paths: dict[str, Path]


def make_source(file: Path, *, lift: int = 0) -> Path:
    """Write a volume of one channel. `lift` is added to all voxels, to make another specimen."""
    voxels = np.asarray(phantoms.f_phantom() + lift)[None]
    return phantoms.write_ome_tiff(file, voxels, "CZYX", names=["F"])


def make_build(source: Path, out: Path) -> Path:
    """Build a volume of one channel in one tile."""
    build = ["build", str(source), "-o", str(out), "--workers", "0", "--grid", "1x1"]
    assert main(build) == 0
    return out


def make_outputs(folder: Path) -> Outputs:
    """Run every command that writes, in a folder."""
    source = make_source(folder / "f.ome.tif")
    out = make_build(source, folder / "out")
    paths = {
        "a build": out,
        **{f"OUT/{part}": out / part for part in ("units", "stage", "bundle", "report")},
        "the report's page": out / "report" / "index.html",
        "a published page": folder / "site",
        "slices": folder / "slices",
        "a picture of iso-values": folder / "iso.png",
        "the sample mri": folder / "head",
        "the sample brain-cells": folder / "brain.ome.tif",
        **{f"exported {ending}": folder / f"cells{ending}" for ending in EXPORTS},
        "no such folder": folder / "nowhere",
    }
    for command in (
        ["publish", out, paths["a published page"]],
        ["slices", source, "-o", paths["slices"], "--channels", "F"],
        [
            "iso",
            source,
            "-o",
            paths["a picture of iso-values"],
            "--channel",
            "F",
            "--tile",
            "r0_c0",
        ],
        ["sample", "mri", paths["the sample mri"]],
        ["sample", "brain-cells", paths["the sample brain-cells"]],
        *(["export", out, paths[f"exported {ending}"]] for ending in EXPORTS),
    ):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(samples, "write_head", _write_small_head)
            assert main([str(word) for word in command]) == 0
    return Outputs(source, paths)


def _write_small_head(path: Path, *, seed: int) -> None:
    write_dicom(path, make_head(shape=(24, 20, 22), seed=seed), seed=seed)
