"""Slices with rounded positions lie at the regular distance that other attributes state."""

from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest

from stereocell import read
from support.dicom_reading import lps_mm, whole
from support.dicom_series import Affine, grid, save, setting, turn, write_series

SHAPE = (25, 12, 14)
SPACING = (0.625, 0.7, 0.5)


def write_rounded(
    folder: Path, affine: Affine, step_mm: float, change: Any = lambda ds, k: None
) -> None:
    """Write slices whose positions are multiples of a step."""

    def changed(ds: pydicom.Dataset) -> None:
        places = [float(np.rint(float(v) / step_mm) * step_mm) for v in ds.ImagePositionPatient]
        ds.ImagePositionPatient = [round(v, 6) for v in places]
        change(ds, ds.InstanceNumber - 1)

    write_series(folder, affine, SHAPE, change=changed, modality="CT")


def by_thickness(ds: pydicom.Dataset, _: int) -> None:
    del ds.SpacingBetweenSlices


def by_spacing(ds: pydicom.Dataset, _: int) -> None:
    ds.SliceThickness = 1.25


def by_location(ds: pydicom.Dataset, index: int) -> None:
    del ds.SpacingBetweenSlices
    ds.SliceThickness, ds.SliceLocation = 1.25, round(-40 + 0.625 * index, 3)
    ds.InstanceNumber = 1


STATED = {
    "SliceThickness (with consecutive InstanceNumbers)": by_thickness,
    "SpacingBetweenSlices (with consecutive InstanceNumbers)": by_spacing,
    "SliceLocation": by_location,
}


@pytest.mark.parametrize("step_mm", [1.0, 0.1])
@pytest.mark.parametrize("name", STATED)
@pytest.mark.slow
def test_no_slice_is_lost_and_the_note_names_the_rounding(
    tmp_path: Path, name: str, step_mm: float
) -> None:
    affine = grid(shape=SHAPE, spacing=SPACING)
    write_rounded(tmp_path / "rounded", affine, step_mm, STATED[name])
    write_series(tmp_path / "exact", affine, SHAPE, modality="CT")
    rounded, exact = read.open(tmp_path / "rounded"), read.open(tmp_path / "exact")
    assert np.array_equal(whole(rounded), whole(exact))
    assert rounded.levels[0].spacing_um == pytest.approx(exact.levels[0].spacing_um)
    assert np.abs(lps_mm(rounded) - lps_mm(exact)).max() <= step_mm / 2 + 1e-3
    (note,) = (note for note in rounded.notes if "slices" in note)
    assert f"ImagePositionPatient, rounded to {step_mm:g} mm, states" in note
    assert f"{name} is used" in note


@pytest.mark.parametrize("falls", [False, True])
@pytest.mark.slow
def test_oblique_slices_that_were_rounded_are_regular(tmp_path: Path, falls: bool) -> None:
    affine = grid(shape=SHAPE, spacing=SPACING, rotation=turn((1, 2, 0), 20))

    def change(ds: pydicom.Dataset, index: int) -> None:
        ds.InstanceNumber = 25 - index if falls else index + 1

    write_rounded(tmp_path / "rounded", affine, 1.0, change)
    write_series(tmp_path / "exact", affine, SHAPE, modality="CT")
    rounded, exact = read.open(tmp_path / "rounded"), read.open(tmp_path / "exact")
    assert np.array_equal(whole(rounded), whole(exact))
    assert np.abs(lps_mm(rounded) - lps_mm(exact)).max() <= 1.0


def test_a_missing_slice_among_rounded_ones_is_interpolated(tmp_path: Path) -> None:
    affine = grid(shape=SHAPE, spacing=SPACING)
    write_rounded(tmp_path, affine, 1.0)
    lacking = next(p for p in tmp_path.iterdir() if pydicom.dcmread(p).InstanceNumber == 12)
    lacking.unlink()
    dataset = read.open(tmp_path)
    assert dataset.levels[0].shape == (12, 25, 14)
    assert any("1 missing slice of 25" in note for note in dataset.notes)


def test_an_image_stored_twice_at_integer_millimetres_does_not_count_as_rounded(
    tmp_path: Path,
) -> None:
    affine = grid(shape=(9, 12, 14), spacing=(1.0, 0.7, 0.5))
    paths = write_series(tmp_path, affine, (9, 12, 14), modality="CT")
    for number, path in enumerate(paths, start=1):
        ds = pydicom.dcmread(path)
        ds.InstanceNumber = number + (number > 4)
        save(ds, path)
    copy = pydicom.dcmread(paths[4])
    copy.InstanceNumber, copy.SOPInstanceUID = 5, "1.2.3.4.5"
    save(copy, tmp_path / "copy")
    dataset = read.open(tmp_path)
    assert dataset.levels[0].shape == (12, 9, 14)
    assert not any("rounded" in note for note in dataset.notes)


def test_time_points_at_integer_millimetres_do_not_count_as_rounded(tmp_path: Path) -> None:
    shape = (9, 12, 14)
    affine = grid(shape=shape, spacing=(1.0, 0.7, 0.5))
    for time in (0, 1):
        paths = write_series(
            tmp_path / f"{time}", affine, shape, series="1.2.3", modality="CT", intercept=time,
            change=setting(SliceThickness=0.5, SpacingBetweenSlices=0.5),
        )  # fmt: skip
        for k, path in enumerate(paths):
            ds = pydicom.dcmread(path)
            ds.InstanceNumber = 1 + 2 * k + time
            save(ds, path)
    assert read.open(tmp_path).time_points == 2


def test_uneven_slices_that_rounding_does_not_explain_keep_their_positions(tmp_path: Path) -> None:
    affine = grid(shape=SHAPE, spacing=SPACING)

    def change(ds: pydicom.Dataset, index: int) -> None:
        x, y, z = ds.ImagePositionPatient
        ds.ImagePositionPatient = [x, y, z + 5 * (index > 12)]

    write_rounded(tmp_path, affine, 1.0, change)
    assert not any("rounded" in note for note in read.open(tmp_path).notes)
