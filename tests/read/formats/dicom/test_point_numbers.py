"""Time points are named by the numbers in the headers, even if some lack slices."""

from collections.abc import Callable
from pathlib import Path

import pytest

from stereocell import read
from support.dicom_kinds import added, write_kind
from support.dicom_series import Change, setting

# attribute -> change of a point's headers by its number from 0, name of the second point
SECOND: dict[str, tuple[Callable[[int], Change], str]] = {
    "TemporalPositionIdentifier": (
        lambda time: setting(TemporalPositionIdentifier=time + 1),
        "time point 2 (TemporalPositionIdentifier 2)",
    ),
    "NominalPercentageOfCardiacPhase": (
        lambda time: setting(NominalPercentageOfCardiacPhase=30.0 * time),
        "time point 2 (NominalPercentageOfCardiacPhase 30 %)",
    ),
    "TriggerTime": (
        lambda time: setting(TriggerTime=25.5 * time),
        "time point 2 (TriggerTime 25.5 ms)",
    ),
    "AcquisitionNumber": (
        lambda time: setting(AcquisitionNumber=7 + 2 * time),
        "time point 2 (AcquisitionNumber 9)",
    ),
    "InstanceNumber": (lambda time: setting(), "time point 2"),
}


def write_points(folder: Path, change: Callable[[int], Change], lacking: int | None) -> None:
    """Write three time points, brighter by 100 each; one lacks its last two slices."""
    for time in range(3):
        indices = range(8 if time == lacking else 10)
        write_kind(folder, 100 * time, change(time), indices=indices, first_number=1 + 10 * time)


@pytest.mark.parametrize("attribute", SECOND)
@pytest.mark.slow
def test_an_incomplete_point_is_named_by_its_number_and_time_counts_the_others(
    tmp_path: Path, attribute: str
) -> None:
    change, name = SECOND[attribute]
    write_points(tmp_path, change, lacking=1)
    assert f"MR, incomplete {name}, axial" in read.list_series(tmp_path)[1]
    assert added(tmp_path, series=2) == 100
    (note,) = (one for one in read.open(tmp_path).notes if "only complete time points" in one)
    assert "from 0: --time 1 is time point 3" in note
    assert added(tmp_path, time=1) == 200


def test_all_numbers_are_noted_if_the_first_point_is_incomplete(tmp_path: Path) -> None:
    write_points(tmp_path, SECOND["AcquisitionNumber"][0], lacking=0)
    assert "incomplete time point 1 (AcquisitionNumber 7)" in read.list_series(tmp_path)[1]
    notes = "\n".join(read.open(tmp_path).notes)
    assert "--time 0 is time point 2 (AcquisitionNumber 9), --time 1 is time point" in notes


def test_numbers_are_noted_if_a_point_is_absent(tmp_path: Path) -> None:
    for time, number in enumerate((1, 3)):
        write_kind(tmp_path, 100 * time, setting(TemporalPositionIdentifier=number))
    notes = "\n".join(read.open(tmp_path).notes)
    assert "--time 1 is time point 2 (TemporalPositionIdentifier 3)" in notes


@pytest.mark.parametrize("lacking", [2, None])
def test_numbers_are_not_noted_if_they_equal_those_of_time(
    tmp_path: Path, lacking: int | None
) -> None:
    write_points(tmp_path, SECOND["TemporalPositionIdentifier"][0], lacking)
    assert not any("only complete time points" in note for note in read.open(tmp_path).notes)


def test_a_number_that_may_be_a_date_is_not_shown(tmp_path: Path) -> None:
    write_points(tmp_path, lambda time: setting(AcquisitionNumber=19700101 + time), lacking=1)
    lines = "".join((*read.list_series(tmp_path), *read.open(tmp_path).notes))
    assert "incomplete time point 2," in lines
    assert "1970" not in lines
