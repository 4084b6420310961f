"""Notes on omitted images agree with their number, for one and for several."""

from pathlib import Path
from typing import Any

import pydicom
import pytest

from stereocell import read
from support.dicom_kinds import AFFINE, SHAPE, image_type, write_kind
from support.dicom_series import setting, write_series


def notes_of(folder: Path) -> str:
    return "\n".join(read.open(folder).notes)


@pytest.mark.parametrize(
    ("count", "words"),
    [
        (1, "left out: 1 image of the same series (localizer), because it is of another kind;"),
        (3, "left out: 3 images of the same series (localizer), because they are of another kind;"),
    ],
)
def test_other_kinds_are_counted(tmp_path: Path, count: int, words: str) -> None:
    write_kind(tmp_path, 100, image_type("M"))
    write_kind(tmp_path, 0, image_type("LOCALIZER"), indices=range(count), first_number=50)
    assert words in notes_of(tmp_path)


@pytest.mark.parametrize(
    ("kinds", "words"),
    [(6, "1 more kind of images is in `--s"), (7, "2 more kinds of images are in `--series list`")],
)
def test_kinds_beyond_the_listed_ones_are_counted(tmp_path: Path, kinds: int, words: str) -> None:
    for echo in range(kinds):
        write_kind(tmp_path, echo, setting(EchoTime=5.0 * (echo + 1)), indices=range(3))
    assert words in notes_of(tmp_path)


@pytest.mark.parametrize(
    ("rests", "words"),
    [
        ((8,), "1 of 3 time points (AcquisitionNumber), because slices are missing (8 of 10 "
         "are there); it is a series of `--series list`"),
        ((8, 7), "2 of 4 time points (AcquisitionNumber), because slices are missing (8, 7 of "
         "10 are there); each is a series of `--series list`"),
    ],
)  # fmt: skip
def test_incomplete_time_points_are_counted(
    tmp_path: Path, rests: tuple[int, ...], words: str
) -> None:
    for time, count in enumerate((10, 10, *rests)):
        change = setting(AcquisitionNumber=time + 1)
        write_kind(tmp_path, 100 * time, change, indices=range(count), first_number=1 + 10 * time)
    assert words in notes_of(tmp_path)


def write_twice(folder: Path, copies: int, change: Any) -> None:
    paths = write_series(folder / "s", AFFINE, SHAPE)
    for place, path in enumerate(paths[2 : 2 + copies]):
        ds = pydicom.dcmread(path)
        change(ds)
        ds.save_as(folder / f"copy{place}")


@pytest.mark.parametrize(
    ("copies", "words"),
    [(1, "file left out: 1 copy of another"), (2, "files left out: 2 copies of others")],
)
def test_copies_are_counted(tmp_path: Path, copies: int, words: str) -> None:
    write_twice(tmp_path, copies, lambda ds: None)
    assert notes_of(tmp_path) == words


@pytest.mark.parametrize(
    ("copies", "words"),
    [(1, "1 duplicate slice with the same"), (2, "2 duplicate slices with the same pixels as")],
)
def test_duplicates_are_counted(tmp_path: Path, copies: int, words: str) -> None:
    uids = iter(("1.2.77.1", "1.2.77.2"))
    write_twice(tmp_path, copies, lambda ds: setattr(ds, "SOPInstanceUID", next(uids)))
    assert words in notes_of(tmp_path)


@pytest.mark.parametrize(
    ("lost", "words"),
    [
        ((4,), "1 missing slice of 10 (10.0%), a gap of 6 mm among slices 3 mm apart"),
        ((3, 6), "2 missing slices of 10 (20.0%), gaps of 6, 6 mm among slices 3 mm apart"),
    ],
)
def test_missing_slices_are_counted(tmp_path: Path, lost: tuple[int, ...], words: str) -> None:
    write_series(tmp_path, AFFINE, SHAPE, indices=[k for k in range(10) if k not in lost])
    assert words in notes_of(tmp_path)


@pytest.mark.parametrize(
    ("without", "words"),
    [
        (1, "1 of 10 images states no rescale: its stored values are used"),
        (2, "2 of 10 images state no rescale: their stored values are used"),
    ],
)
def test_images_without_rescale_are_counted(tmp_path: Path, without: int, words: str) -> None:
    def change(ds: pydicom.Dataset) -> None:
        if ds.InstanceNumber <= without:
            del ds.RescaleSlope, ds.RescaleIntercept

    write_kind(tmp_path, 0, change)
    assert words in notes_of(tmp_path)
