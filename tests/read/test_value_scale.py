"""Packed values by CF's attributes: the expected values are computed from the conventions."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.errors import SourceError

RANDOM = np.random.default_rng(3)


def write(path: Path, stored: NDArray[Any], **attributes: Any) -> Path:
    with h5py.File(path, "w") as file:
        made = file.create_dataset("ct", data=stored)
        made.attrs.update({"element_size_um": (1.0, 1.0, 1.0), **attributes})
    return path


def whole(path: Path) -> tuple[NDArray[Any], tuple[str, ...]]:
    dataset = read.open(path)
    return dataset.read(0, dataset.levels[0].box).voxels, dataset.notes


def test_scale_and_offset_are_applied_and_whole_numbers_stay_whole(tmp_path: Path) -> None:
    stored = RANDOM.integers(0, 256, (5, 6, 7)).astype(np.uint8)
    voxels, notes = whole(
        write(tmp_path / "a.h5", stored, scale_factor=2.0, add_offset=np.array([-500.0]))
    )
    np.testing.assert_array_equal(voxels, 2 * stored.astype(int) - 500)
    assert voxels.dtype == np.int16
    assert any("scale_factor 2 and add_offset -500 are applied" in note for note in notes)


@pytest.mark.parametrize("name", ["_FillValue", "missing_value"])
@pytest.mark.parametrize("dtype", [np.int16, np.float32])
def test_voxels_of_a_fill_value_are_read_as_the_smallest_measured_one(
    tmp_path: Path, name: str, dtype: Any
) -> None:
    stored = RANDOM.integers(10, 900, (5, 6, 7)).astype(dtype)
    stored[:2] = -9999
    path = write(tmp_path / "a.h5", stored, add_offset=0.5, **{name: dtype(-9999)})
    voxels, notes = whole(path)
    expected = stored + 0.5
    expected[:2] = expected[2:].min()
    np.testing.assert_array_equal(voxels, expected)
    assert any(f"{name} -9999" in note for note in notes)


@pytest.mark.parametrize(
    ("attributes", "low", "high"),
    [
        ({"valid_range": np.array([20, 200], np.int16)}, 20, 200),
        ({"valid_min": np.int16(20)}, 20, 999),
        ({"valid_max": np.int16(200)}, 0, 200),
        # The NetCDF Users Guide: a range of the unpacked type refers to unpacked values.
        ({"valid_range": np.array([40.0, 400.0]), "scale_factor": 2.0}, 20, 200),
    ],
)
def test_voxels_outside_the_valid_range_are_not_measurements(
    tmp_path: Path, attributes: dict[str, Any], low: int, high: int
) -> None:
    stored = RANDOM.integers(0, 1000, (5, 6, 7)).astype(np.int16)
    voxels, notes = whole(write(tmp_path / "a.h5", stored, **attributes))
    is_valid = (stored >= low) & (stored <= high)
    values = stored.astype(float) * attributes.get("scale_factor", 1.0)
    np.testing.assert_array_equal(voxels, np.where(is_valid, values, values[is_valid].min()))
    assert any("by the valid range" in note for note in notes)


@pytest.mark.parametrize(("dtype", "attribute"), [(np.int8, "true"), (np.uint16, "false")])
def test_the_sign_of_integers_may_be_stated_beside_them(
    tmp_path: Path, dtype: Any, attribute: str
) -> None:
    stored = RANDOM.integers(0, 256, (5, 6, 7)).astype(np.uint8).view(np.int8).astype(dtype)
    voxels, notes = whole(write(tmp_path / "a.h5", stored, _Unsigned=attribute))
    other = np.uint8 if dtype == np.int8 else np.int16
    np.testing.assert_array_equal(voxels, stored.view(other))
    assert any(f"_Unsigned = '{attribute}'" in note for note in notes)


def test_attributes_that_change_nothing_leave_the_stored_integers(tmp_path: Path) -> None:
    stored = RANDOM.integers(0, 70_000, (5, 6, 7)).astype(np.uint32)
    path = write(
        tmp_path / "a.h5", stored, scale_factor=1.0, add_offset=0.0, _FillValue=np.uint32(0)
    )
    dataset = read.open(path)
    assert dataset.stored_dtype == np.uint32
    assert not any("values:" in note for note in dataset.notes)


@pytest.mark.parametrize("factor", [0.0, np.nan, np.array([1.0, 2.0])])
def test_a_factor_that_is_not_a_number_is_refused(tmp_path: Path, factor: Any) -> None:
    path = write(tmp_path / "a.h5", np.ones((5, 6, 7), np.uint8), scale_factor=factor)
    with pytest.raises(SourceError, match="scale_factor: found"):
        read.open(path)
