"""Reading writes no file, so a killed process or a full disk leaves nothing half-written."""

import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import nibabel
import nrrd
import numpy as np
import pytest
import zarr

from stereocell import read
from support.array_files import write_czi
from support.dicom_kinds import AFFINE, SHAPE
from support.dicom_series import JPEGLosslessSV1, compress, write_series

VOXELS = np.arange(4 * 8 * 8, dtype=np.uint16).reshape(4, 8, 8)


def _zipped(folder: Path) -> Path:
    group = zarr.create_group(folder.parent / "unpacked", zarr_format=3)
    group.create_array("0", data=VOXELS, chunks=(4, 8, 8))
    axes = [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]
    scale = [{"type": "scale", "scale": [2, 1, 1]}]
    datasets = [{"path": "0", "coordinateTransformations": scale}]
    group.attrs["ome"] = {"version": "0.5", "multiscales": [{"axes": axes, "datasets": datasets}]}
    with zipfile.ZipFile(folder / "a.ozx", "w") as archive:
        for file in sorted((folder.parent / "unpacked").rglob("*")):
            archive.write(file, file.relative_to(folder.parent / "unpacked"))
    return folder / "a.ozx"


def _nifti(folder: Path) -> Path:
    nibabel.save(nibabel.Nifti1Image(VOXELS.astype(np.int16), np.eye(4)), folder / "a.nii.gz")
    return folder / "a.nii.gz"


def _nrrd(folder: Path) -> Path:
    header = {"space": "left-posterior-superior", "space directions": np.eye(3), "encoding": "gzip"}
    nrrd.write(str(folder / "a.nrrd"), VOXELS, header)
    return folder / "a.nrrd"


def _jpeg_dicom(folder: Path) -> Path:
    for path in write_series(folder, AFFINE, SHAPE, dtype=np.uint16):
        compress(path, JPEGLosslessSV1)
    return folder


def _czi(folder: Path) -> Path:
    return write_czi(folder / "a.czi", {None: VOXELS[None, None]})


@pytest.mark.parametrize("write", [_zipped, _nifti, _nrrd, _jpeg_dicom, _czi])
def test_reading_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, write: Callable[[Path], Path]
) -> None:
    folder, scratch, working = (tmp_path / name for name in ("in", "tmp", "cwd"))
    for one in (folder, scratch, working):
        one.mkdir()
    source = write(folder)
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    monkeypatch.setenv("TMPDIR", str(scratch))
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.chdir(working)
    dataset = read.open(source)
    assert dataset.read(0, dataset.levels[0].box).voxels.max() > 0
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before
    assert [*scratch.iterdir(), *working.iterdir()] == []
