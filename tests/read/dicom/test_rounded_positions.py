"""Positions that were rounded to whole millimetres are restored by another stated distance."""

from pathlib import Path

import numpy as np
import pydicom
import pytest

from stereocell import read
from support.dicom_reading import whole
from support.dicom_series import Change, grid, setting, write_series

SHAPE = (16, 12, 14)


def rounded(ds: pydicom.Dataset) -> None:
    ds.ImagePositionPatient = [round(float(value)) for value in ds.ImagePositionPatient]


def both(*changes: Change) -> Change:
    def change(ds: pydicom.Dataset) -> None:
        for one in changes:
            one(ds)

    return change


@pytest.mark.parametrize("distance", [0.625, 1.25, 2.4])
@pytest.mark.parametrize("is_reversed", [False, True])
def test_slices_whose_positions_were_rounded_all_stay(
    tmp_path: Path, distance: float, is_reversed: bool
) -> None:
    affine = grid(shape=SHAPE, spacing=(distance, 2.0, 2.2))
    count = SHAPE[0]
    change = both(
        rounded, lambda ds: setattr(ds, "InstanceNumber", count - ds.InstanceNumber)
    ) if is_reversed else rounded  # fmt: skip
    write_series(tmp_path / "s", affine, SHAPE, change=change)
    write_series(tmp_path / "exact", affine, SHAPE)
    dataset, exact = read.open(tmp_path / "s"), read.open(tmp_path / "exact")
    assert dataset.levels[0].spacing_um == pytest.approx(exact.levels[0].spacing_um, rel=1e-6)
    np.testing.assert_array_equal(whole(dataset), whole(exact))
    offset = np.array(dataset.placement)[:3, 3] - np.array(exact.placement)[:3, 3]
    assert np.abs(offset).max() <= 1000  # um: no position moved by more than the rounding
    (note,) = dataset.notes
    assert f"the slices lie {distance:g} mm apart by SpacingBetweenSlices" in note


@pytest.mark.parametrize(
    "change",
    [
        setting(SliceThickness=1.0, SpacingBetweenSlices=1.0),
        setting(SliceThickness=1.4, SpacingBetweenSlices=1.4),
    ],
)
def test_whole_positions_that_no_distance_explains_stay(tmp_path: Path, change: Change) -> None:
    """Slices 1 mm apart, of which some are missing, are no rounding."""
    affine = grid(shape=SHAPE, spacing=(1.0, 2.0, 2.0))
    affine[:3, 3] = np.rint(affine[:3, 3])
    present = [0, 1, 2, 3, 8, 9, 10, 11, 12, 13, 14, 15]
    write_series(tmp_path / "s", affine, SHAPE, indices=present, change=change)
    dataset = read.open(tmp_path / "s")
    assert min(dataset.levels[0].spacing_um) == pytest.approx(1000)
    assert any("4 missing slices of 16" in note for note in dataset.notes)
    assert not any("whole millimetres" in note for note in dataset.notes)
