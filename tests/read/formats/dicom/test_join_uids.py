"""One volume whose series UIDs were replaced is joined; two separate series stay separate."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pydicom
import pytest
from pydicom.uid import generate_uid

from stereocell import read
from stereocell.model.errors import SourceError
from support.dicom_reading import error
from support.dicom_series import Change, grid, setting, write_series

SHAPE = (10, 12, 14)
AFFINE = grid(shape=SHAPE, spacing=(2.5, 2.0, 2.2))
Batch = Callable[[pydicom.Dataset], int]

BATCHES: dict[str, Batch] = {
    "one for each file": lambda ds: ds.InstanceNumber,
    "lower and upper half": lambda ds: int(ds.InstanceNumber > 5),
    "three runs": lambda ds: ds.InstanceNumber // 4,
    "in turn": lambda ds: ds.InstanceNumber % 2,
    "a slice apart": lambda ds: int(ds.InstanceNumber == 10),
}


def batched(batch: Batch, *names: str, **values: Any) -> Change:
    """Return a function that sets the elements `names` to one UID for each batch of slices."""

    def change(ds: pydicom.Dataset) -> None:
        for name in names:
            setattr(ds, name, f"1.2.77.{batch(ds)}")
        setting(**values)(ds)

    return change


@pytest.mark.parametrize("name", BATCHES)
@pytest.mark.parametrize("is_numbered", [True, False])
def test_one_volume_over_several_series_uids_is_joined(
    tmp_path: Path, name: str, is_numbered: bool
) -> None:
    values = {"SeriesNumber": 4} if is_numbered else {}
    change = batched(BATCHES[name], "SeriesInstanceUID", SeriesDescription="JANE", **values)
    write_series(tmp_path, AFFINE, SHAPE, change=change)
    assert len(read.list_series(tmp_path)) == 1
    dataset = read.open(tmp_path)
    assert error(dataset) <= 0.51
    (note,) = dataset.notes
    assert "SeriesInstanceUID" in note
    assert "as after de-identification: joined, since study, description, orientation" in note
    assert "JANE" not in note


@pytest.mark.parametrize("name", ["one for each file", "three runs"])
def test_frames_of_reference_that_change_with_the_series_are_joined(
    tmp_path: Path, name: str
) -> None:
    change = batched(BATCHES[name], "SeriesInstanceUID", "FrameOfReferenceUID")
    write_series(tmp_path, AFFINE, SHAPE, change=change)
    (note,) = read.open(tmp_path).notes
    assert "SeriesInstanceUID" in note
    assert "FrameOfReferenceUID" in note


def halves(folder: Path, lower: Change, upper: Change, **upper_values: Any) -> int:
    """Write two halves of a volume as two series, and return the number of series that are read."""
    write_series(folder / "a", AFFINE, SHAPE, indices=range(5), series="1.2.1", change=lower)

    def later(ds: pydicom.Dataset) -> None:
        ds.InstanceNumber += 5
        upper(ds)

    options = {"indices": range(5, 10), **upper_values}
    write_series(folder / "b", AFFINE, SHAPE, series="1.2.2", change=later, **options)
    return len(read.list_series(folder))


def test_two_halves_are_one_series(tmp_path: Path) -> None:
    assert halves(tmp_path, setting(), setting()) == 1


DIFFERENCES: dict[str, dict[str, Any]] = {
    "study": {"StudyInstanceUID": "1.2.3.88"},
    "number of the series": {"SeriesNumber": 5},
    "description": {"SeriesDescription": "abdomen"},
    "protocol": {"ProtocolName": "abdomen"},
    "echo time": {"EchoTime": 20.0},
    "image type": {"ImageType": ["DERIVED", "PRIMARY"]},
    "frame of reference": {"FrameOfReferenceUID": "1.2.3.99"},
    "thickness": {"SliceThickness": 5.0},
    "acquisition": {"AcquisitionNumber": 2},
}


@pytest.mark.parametrize("name", DIFFERENCES)
def test_halves_that_differ_are_two_series(tmp_path: Path, name: str) -> None:
    assert halves(tmp_path, setting(AcquisitionNumber=1), setting(**DIFFERENCES[name])) == 2


@pytest.mark.parametrize("is_numbered", [True, False])
def test_series_with_a_common_position_stay_separate(tmp_path: Path, is_numbered: bool) -> None:
    change = setting(**({"SeriesNumber": 4} if is_numbered else {}))
    assert halves(tmp_path, change, change, indices=range(4, 10)) == 2


def test_series_that_count_from_1_again_stay_separate_unless_they_have_one_number(
    tmp_path: Path,
) -> None:
    again = setting(InstanceNumber=1)
    assert halves(tmp_path / "x", setting(), again) == 2
    four = setting(SeriesNumber=4)
    assert halves(tmp_path / "y", four, setting(InstanceNumber=1, SeriesNumber=4)) == 1


def test_interleaved_thick_slices_are_two_series(tmp_path: Path) -> None:
    change = batched(BATCHES["in turn"], "SeriesInstanceUID", SliceThickness=5.0)
    write_series(tmp_path, AFFINE, SHAPE, change=change)
    assert len(read.list_series(tmp_path)) == 2


def test_series_with_a_gap_between_them_stay_separate(tmp_path: Path) -> None:
    assert halves(tmp_path, setting(), setting(), indices=range(7, 12)) == 2


def test_two_volumes_with_a_series_for_each_file_are_two_series(tmp_path: Path) -> None:
    def change(ds: pydicom.Dataset) -> None:
        ds.SeriesInstanceUID = generate_uid()

    for number in (1, 2):
        numbered = [change, setting(SeriesNumber=number)]
        write_series(tmp_path / f"{number}", AFFINE, SHAPE,
                     change=lambda ds, both=numbered: [one(ds) for one in both])  # fmt: skip
    assert len(read.list_series(tmp_path)) == 2


def test_a_series_for_each_slice_at_irregular_positions_is_refused_with_the_reason(
    tmp_path: Path,
) -> None:
    def change(ds: pydicom.Dataset) -> None:
        ds.SeriesInstanceUID = generate_uid()

    write_series(tmp_path, AFFINE, SHAPE, indices=[0, 1, 2.3, 3, 4, 5.6], change=change)
    with pytest.raises(SourceError) as caught:
        read.open(tmp_path)
    line = str(caught.value)
    assert "found 6 stacks of one slice each, which differ in SeriesInstanceUID" in line
    assert "irregular positions (gaps of" in line
