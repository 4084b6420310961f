"""A CT whose intercept was applied before storage is not read as Hounsfield units."""

from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.planning.settings import load
from stereocell.read.formats.dicom.twice_rescaled import LEVEL_HU, WINDOW_HU
from support.dicom_series import grid, write_series

SHAPE = (8, 40, 44)
AFFINE = grid(shape=SHAPE, spacing=(5.0, 4.0, 4.0))
RADIUS = 12  # pixels of the body; the scanner's circle has 20


def write_ct(folder: Path, *, stored_offset: int, intercept: int, padding: int = 0) -> Path:
    """Write a body of 40 HU with bone of 700 HU in noisy air.

    stored_offset  is added to Hounsfield units before they are stored
    padding        stored value around the scanner's circle that no header names; 0: none
    """
    y, x = np.mgrid[: SHAPE[1], : SHAPE[2]]
    out = np.hypot(y - SHAPE[1] / 2, x - SHAPE[2] / 2)
    rng = np.random.default_rng(5)

    def change(ds: pydicom.Dataset) -> None:
        hu = np.where(out < RADIUS, 40.0, -1000.0)
        hu[out < 3] = 700
        hu = hu + rng.normal(0, 15, hu.shape)
        stored = hu + stored_offset
        if padding:
            stored[out > 20] = padding
        ds.PixelData = np.rint(stored).astype(np.int16).tobytes()
        ds.RescaleSlope, ds.RescaleIntercept = 1, intercept

    write_series(folder, AFFINE, SHAPE, modality="CT", change=change)
    return folder


def notes_of(dataset: Any) -> list[str]:
    return [note for note in dataset.notes if "applied twice" in note]


@pytest.mark.parametrize("intercept", [-1024, -1000])
def test_an_intercept_that_was_applied_twice_is_noted_once(tmp_path: Path, intercept: int) -> None:
    dataset = read.open(write_ct(tmp_path / "s", stored_offset=0, intercept=intercept))
    assert not dataset.has_hounsfield_units
    (note,) = notes_of(dataset)
    assert f"RescaleIntercept {intercept} seems to be applied twice" in note
    assert "states no Hounsfield units" not in "".join(dataset.notes)


@pytest.mark.parametrize("padding", [0, -2000])
def test_a_ct_that_is_stored_with_the_offset_is_in_hounsfield_units(
    tmp_path: Path, padding: int
) -> None:
    """This holds even if padding that no header names lies far below air."""
    folder = write_ct(tmp_path / "s", stored_offset=1024, intercept=-1024, padding=padding)
    dataset = read.open(folder)
    assert dataset.has_hounsfield_units
    assert notes_of(dataset) == []


def test_hounsfield_units_without_an_offset_do_not_count_as_applied_twice(
    tmp_path: Path,
) -> None:
    dataset = read.open(write_ct(tmp_path / "s", stored_offset=0, intercept=0))
    assert dataset.has_hounsfield_units
    assert notes_of(dataset) == []


def test_the_flags_in_the_note_are_the_preset_shifted_by_the_intercept(
    tmp_path: Path,
) -> None:
    preset = load("ct", None, flags={})
    assert preset.iso_values == {"*": LEVEL_HU}
    assert preset.windows == {"*": "{:g}:{:g}".format(*WINDOW_HU)}
    folder = write_ct(tmp_path / "s", stored_offset=0, intercept=-1024)
    (note,) = notes_of(read.open(folder))
    flags = note.split("(")[1].split(" are those of CT")[0].split()
    out = tmp_path / "out"
    assert main(["plan", str(folder), "-o", str(out), *flags]) == 0
    text = (out / "plan.json").read_text("utf-8")
    assert all(value in text for value in ("-1324", "-2048", "976"))
