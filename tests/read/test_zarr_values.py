"""Value scales of Zarr arrays, by the attributes that CF defines and xarray writes."""

import base64
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.planning import input_files
from support.phantoms import f_phantom, write_ome_zarr
from support.reading import read_voxels

BODY = f_phantom().astype(np.int16)
PACKED = {"scale_factor": 2.0, "add_offset": -1024.0}


def write(path: Path, version: Any, attributes: dict[str, Any], **options: Any) -> Path:
    array = zarr.create_array(
        path, shape=BODY.shape, dtype="i2", chunks=(8, 24, 18), zarr_format=version,
        attributes=attributes, **options,
    )  # fmt: skip
    array[...] = BODY
    return path


@pytest.mark.parametrize("version", [2, 3])
def test_scale_and_offset_of_an_array_are_applied(tmp_path: Path, version: int) -> None:
    path = write(tmp_path / "a.zarr", version, PACKED)
    np.testing.assert_array_equal(read_voxels(path, spacing_um=(1, 1, 1)), BODY * 2.0 - 1024)
    notes = read.open(path, spacing_um=(1, 1, 1)).notes
    assert any("scale_factor 2 and add_offset -1024" in note for note in notes)


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_scale_and_offset_of_an_ome_zarr_are_applied_to_all_levels(
    tmp_path: Path, version: str
) -> None:
    scales = [{"z": 1, "y": 1, "x": 1}, {"z": 2, "y": 2, "x": 2}]
    levels = [BODY, BODY[::2, ::2, ::2]]
    path = write_ome_zarr(tmp_path / "a.zarr", levels, version=version, scales=scales)
    zarr.open_array(path / "0").attrs.update(PACKED)
    dataset = read.open(path)
    for level, stored in enumerate(levels):
        found = dataset.read(0, dataset.levels[level].box, level).voxels
        np.testing.assert_array_equal(found, stored * 2.0 - 1024)


@pytest.mark.parametrize(
    ("version", "attributes", "options"),
    [
        (2, {"_ARRAY_DIMENSIONS": ["z", "y", "x"]}, {"fill_value": 1000}),
        (2, {"_FillValue": 1000}, {}),
        (3, {"_FillValue": base64.b64encode(struct.pack("<d", 1000.0)).decode()}, {}),
    ],
)
def test_fill_values_are_not_measurements(
    tmp_path: Path, version: int, attributes: dict[str, Any], options: dict[str, Any]
) -> None:
    path = write(tmp_path / "a.zarr", version, attributes, **options)
    assert read_voxels(path, spacing_um=(1, 1, 1)).max() == 100
    notes = read.open(path, spacing_um=(1, 1, 1)).notes
    assert any("_FillValue 1000" in note for note in notes)


def test_the_value_of_absent_chunks_is_a_measurement(tmp_path: Path) -> None:
    path = write(tmp_path / "a.zarr", 2, {}, fill_value=1000)
    assert read_voxels(path, spacing_um=(1, 1, 1)).max() == 1000


def test_lost_chunks_of_scaled_voxels_are_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "a.zarr", 3, PACKED)
    (path / "c" / "1" / "0" / "0").unlink()
    input_files.forget()
    plan = ["plan", str(path), "-o", str(tmp_path / "o"), "--spacing-um", "1,1,1"]
    assert main([*plan, "--as", "intensity"]) == 0
    assert "1 of 8 chunks of resolution level 0" in capsys.readouterr().err
