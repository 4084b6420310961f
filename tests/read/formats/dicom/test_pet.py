"""PET series as scanners write them: values, units, corrections, time points, bed positions."""

from pathlib import Path
from typing import Any

import highdicom
import numpy as np
import pydicom
import pytest

from stereocell import read
from support.dicom_kinds import added
from support.dicom_reading import error, whole
from support.dicom_series import scene
from support.pet_series import AFFINE, SHAPE, write_pet


def notes_of(folder: Path) -> str:
    return "\n".join(read.open(folder).notes)


def test_each_slice_has_its_own_scale_and_the_unit_is_noted(tmp_path: Path) -> None:
    write_pet(tmp_path)
    dataset = read.open(tmp_path)
    assert error(dataset) < 0.02  # half a step of the coarsest scale; the scene reaches 1000
    assert dataset.modality == "PT"
    assert "becquerels per millilitre (Units BQML), not standardized uptake" in notes_of(tmp_path)


CORRECTIONS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "CorrectedImage": ({"CorrectedImage": ["DECY"]}, {"CorrectedImage": ["DECY", "ATTN"]}),
    "AttenuationCorrectionMethod": (
        {"CorrectedImage": None, "AttenuationCorrectionMethod": "NONE"},
        {"CorrectedImage": None, "AttenuationCorrectionMethod": "measured, CT"},
    ),
    "SeriesDescription": (
        {"CorrectedImage": None, "SeriesDescription": "JANE_WB_NAC"},
        {"CorrectedImage": None, "SeriesDescription": "JANE_WB_AC"},
    ),
}


@pytest.mark.parametrize("name", CORRECTIONS)
@pytest.mark.parametrize("series", ["1.2.3", "1.2.9"])
@pytest.mark.slow
def test_a_corrected_image_is_built_before_an_uncorrected_one(
    tmp_path: Path, name: str, series: str
) -> None:
    without, corrected = CORRECTIONS[name]
    write_pet(tmp_path, 300, **without)
    write_pet(tmp_path, 100, series=series, first=50, **corrected)
    lines = read.list_series(tmp_path)
    assert [added(tmp_path, n) for n in (1, 2)] == pytest.approx([100, 300], abs=0.1)
    assert "not attenuation corrected" in lines[1]
    assert "not attenuation corrected" not in lines[0]
    assert "JANE" not in "".join((*lines, *read.open(tmp_path).notes))


def test_a_larger_uncorrected_series_follows_the_corrected_one(tmp_path: Path) -> None:
    write_pet(tmp_path, 300, series="1.2.8", indices=range(-4, 12), CorrectedImage=["DECY"])
    write_pet(tmp_path, 100, series="1.2.9")
    assert added(tmp_path) == pytest.approx(100, abs=0.1)


TIMES: dict[str, dict[str, Any]] = {
    "the same time in all slices": {},
    "a time for each slice": {"FrameReferenceTime": lambda place: 10.0 * place},
    "ImageIndex alone": {"FrameReferenceTime": None},
}


@pytest.mark.parametrize("name", TIMES)
@pytest.mark.slow
def test_frames_of_dynamic_pet_are_time_points(tmp_path: Path, name: str) -> None:
    for time in (2, 0, 1):
        values: dict[str, Any] = {"FrameReferenceTime": 5000.0 * time, **TIMES[name]}
        if callable(per_slice := values["FrameReferenceTime"]):
            values["FrameReferenceTime"] = lambda n, t=time, f=per_slice: 5000.0 * t + f(n)
        write_pet(
            tmp_path,
            100 * (time + 1),
            first=101 - 10 * time,  # in the reverse order of time
            SeriesType=["DYNAMIC", "IMAGE"],
            NumberOfTimeSlices=3,
            NumberOfSlices=10,
            ImageIndex=lambda place, time=time: 1 + place + 10 * time,
            **values,
        )
    found = [added(tmp_path, time=time) for time in range(3)]
    assert found == pytest.approx([100, 200, 300], abs=0.1)
    assert "InstanceNumber" not in notes_of(tmp_path)
    assert "number of time points" not in notes_of(tmp_path)


def test_stated_but_absent_time_points_are_noted(tmp_path: Path) -> None:
    for time in range(2):
        write_pet(tmp_path, 9 * time, first=1 + 10 * time, FrameReferenceTime=1e3 * time,
                  NumberOfTimeSlices=3)  # fmt: skip
    assert "NumberOfTimeSlices states 3, but there are only 2" in notes_of(tmp_path)


@pytest.mark.parametrize("tag", ["FrameReferenceTime", "AcquisitionNumber", "InstanceNumber"])
@pytest.mark.slow
def test_beds_that_overlap_are_one_volume_of_their_inner_slices(tmp_path: Path, tag: str) -> None:
    for bed in range(3):
        values = {"FrameReferenceTime": None} if tag == "InstanceNumber" else {tag: bed + 1}
        write_pet(
            tmp_path,
            10.0 * bed,
            first=1 + 10 * bed,
            indices=range(6 * bed, 6 * bed + 10),
            SeriesType=["WHOLE BODY", "IMAGE"],
            **{"FrameReferenceTime": 1.0, **values},
        )
    dataset = read.open(tmp_path)
    assert (dataset.time_points, dataset.levels[0].shape) == (1, (12, 22, 14))
    assert "3 bed positions overlap" in notes_of(tmp_path)
    assert "and 8 images are left out" in notes_of(tmp_path)
    index = np.arange(22)
    lps = np.zeros((22, 3)) + AFFINE[:3, 3] + index[:, None] * AFFINE[:3, 0]
    corners = whole(dataset)[-1, ::-1, 0]  # y runs to inferior
    beds = corners - scene(lps)
    assert beds == pytest.approx([0.0] * 8 + [10.0] * 6 + [20.0] * 8, abs=0.1)


def test_a_projection_of_the_volume_is_left_out(tmp_path: Path) -> None:
    write_pet(tmp_path, 300, SeriesType=["WHOLE BODY", "REPROJECTION"])
    write_pet(tmp_path, 100, first=50, SeriesType=["WHOLE BODY", "IMAGE"])
    assert added(tmp_path) == pytest.approx(100, abs=0.1)
    assert "(projection)" in notes_of(tmp_path)


def test_images_of_two_units_are_two_series(tmp_path: Path) -> None:
    write_pet(tmp_path, 300, Units="GML", SUVType="LBM")
    write_pet(tmp_path, 100, first=50)
    assert [added(tmp_path, n) for n in (1, 2)] == pytest.approx([100, 300], abs=0.1)
    note = read.open(tmp_path, series=2).notes
    assert any("uptake values in grams per millilitre (Units GML), SUVType LBM" in n for n in note)


def test_the_factor_of_philips_to_uptake_values_is_noted(tmp_path: Path) -> None:
    write_pet(tmp_path, Units="CNTS")
    for path in tmp_path.iterdir():
        ds = pydicom.dcmread(path)
        ds.private_block(0x7053, "Philips PET Private Group", create=True).add_new(0, "DS", "0.002")
        ds.save_as(path)
    assert "counts, not activity" in notes_of(tmp_path)
    assert "factor of 0.002 from these values to standardized uptake" in notes_of(tmp_path)


def test_an_enhanced_image_that_highdicom_converts_has_the_same_values(tmp_path: Path) -> None:
    write_pet(tmp_path / "slices")
    slices = [pydicom.dcmread(path) for path in sorted((tmp_path / "slices").iterdir())]
    for ds in slices:
        ds.PatientID = ds.PatientName = ds.PatientBirthDate = ds.PatientSex = ""
        ds.StudyID = ds.StudyDate = ds.StudyTime = ds.AccessionNumber = ""
        ds.ReferringPhysicianName = ds.PositionReferenceIndicator = ""
        ds.Manufacturer, ds.SeriesNumber, ds.ImageType = "M", 1, ["ORIGINAL", "PRIMARY"]
    enhanced = highdicom.legacy.LegacyConvertedEnhancedPETImage(
        slices, pydicom.uid.generate_uid(), 2, pydicom.uid.generate_uid(), 1
    )
    enhanced.save_as(tmp_path / "enhanced.dcm")
    dataset = read.open(tmp_path / "enhanced.dcm")
    assert dataset.levels[0].shape == (12, 10, 14)
    assert error(dataset) < 0.02
    assert "Units BQML" in notes_of(tmp_path / "enhanced.dcm")
    assert SHAPE == (10, 12, 14)
