"""Attributes that contradict the geometry of the slices are named, each in one note."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from stereocell import read
from support.dicom_reading import error
from support.dicom_series import Change, grid, setting, tilted, write_series

SHAPE = (10, 12, 14)
AFFINE = grid(shape=SHAPE, spacing=(2.5, 2.0, 2.2))


def by_number(name: str, value: Callable[[int], object]) -> Change:
    return lambda ds: setattr(ds, name, value(int(ds.InstanceNumber)))


CONTRADICTIONS: dict[str, tuple[Change, str]] = {
    "distance": (
        setting(SpacingBetweenSlices=5.0),
        "distance of slices: ImagePositionPatient states 2.5 mm, SpacingBetweenSlices states 5 mm",
    ),
    "location": (
        by_number("SliceLocation", lambda n: 1.25 * n),
        "ImagePositionPatient states 2.5 mm, SliceLocation states 1.25 mm",
    ),
    "thin slices": (setting(SliceThickness=1.0), "60% of the distance lies in gaps"),
    "thick slices": (setting(SliceThickness=20.0), "neighbouring slices overlap"),
    "detector": (
        setting(ImagerPixelSpacing=[3.0, 3.3]),
        "PixelSpacing states 2, 2.2 mm, ImagerPixelSpacing states 3, 3.3 mm: PixelSpacing is used",
    ),
    "aspect": (
        setting(PixelAspectRatio=[1, 2]),
        "PixelSpacing states 0.90909, PixelAspectRatio states 0.5: PixelSpacing is used",
    ),
    "absent slices": (
        setting(NumberOfSlices=20),
        "NumberOfSlices states 20, but there are 10: 50% of the stated slices are missing",
    ),
    "more slices": (setting(NumberOfSlices=8), "states 8, but there are 10: all of them are read"),
    "numbers": (
        by_number("InstanceNumber", lambda n: (7 * n) % 11),
        "order of slices: ImagePositionPatient states the order that is used, InstanceNumber",
    ),
    "order of locations": (
        by_number("SliceLocation", lambda n: 2.5 * (n + (n == 4) - (n == 5))),
        "SliceLocation states another order (1 of 9 steps leads back)",
    ),
    "gantry": (
        setting(GantryDetectorTilt=20.0),
        "gantry tilt: ImagePositionPatient states 0 degrees, GantryDetectorTilt states 20 degrees",
    ),
    "patient position": (
        by_number("PatientPosition", lambda n: "FFS" if n < 3 else "HFS"),
        "PatientPosition is FFS and HFS among the slices",
    ),
    "letters": (
        setting(PatientOrientation=["R", "A"]),
        "ImageOrientationPatient states L, P, PatientOrientation states R, A",
    ),
}


@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_a_contradiction_makes_one_note_and_positions_are_used(tmp_path: Path, name: str) -> None:
    change, words = CONTRADICTIONS[name]
    write_series(tmp_path / "s", AFFINE, SHAPE, change=change)
    dataset = read.open(tmp_path / "s")
    assert error(dataset) <= 0.51
    (note,) = dataset.notes
    assert words in note


AGREEMENTS: dict[str, Change] = {
    "all": setting(SpacingBetweenSlices=-2.5, GantryDetectorTilt=0, PatientPosition="FFS"),
    "letters": setting(PatientOrientation=["LH", "PF"]),
    "letters of no plane": setting(PatientOrientation=["L", "R"]),
    "location": by_number("SliceLocation", lambda n: 700 - 2.5 * n),
    "rounded location": by_number("SliceLocation", lambda n: round(2.5 * n)),
    "numbers from the other end": by_number("InstanceNumber", lambda n: 100 - n),
    "no numbers": setting(InstanceNumber=0),
    "overlap": setting(SliceThickness=5.0),
    "detector": setting(ImagerPixelSpacing=[2.0, 2.2]),
    "aspect": setting(PixelAspectRatio=[10, 11]),
    "aspect of zero": setting(PixelAspectRatio=[0, 0]),
    "slices": setting(NumberOfSlices=10),
    "junk": setting(PatientPosition="JANE", PatientOrientation="JANE"),
}


@pytest.mark.parametrize("name", AGREEMENTS)
def test_attributes_that_agree_need_no_note(tmp_path: Path, name: str) -> None:
    write_series(tmp_path / "s", AFFINE, SHAPE, change=AGREEMENTS[name])
    assert read.open(tmp_path / "s").notes == ()


@pytest.mark.parametrize("stated", [15.0, -15.0])
def test_a_stated_tilt_that_agrees_with_positions_makes_no_note(
    tmp_path: Path, stated: float
) -> None:
    affine = tilted(AFFINE, SHAPE, 15.0)
    place = {
        "distance": np.linalg.norm(affine[:3, 0]),  # along the table
    }
    change = by_number("SliceLocation", lambda n: float(n * place["distance"]))
    write_series(
        tmp_path / "s",
        affine,
        SHAPE,
        change=lambda ds: (change(ds), setting(GantryDetectorTilt=stated)(ds)),
    )
    (note,) = read.open(tmp_path / "s").notes
    assert note.startswith("gantry tilt of 15 degrees: resampled")
