"""Odd series that users have reported: each is read correctly, or a note states the assumption."""

from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest
from pydicom.uid import RTDoseStorage

from stereocell import read
from support.dicom_kinds import AFFINE, SHAPE, added, image_type, write_kind
from support.dicom_series import grid, image, sample, save, setting, write_series


def notes_of(folder: Path) -> str:
    return "\n".join(read.open(folder).notes)


@pytest.mark.parametrize(
    ("words", "assumed"),
    [(("M", "ND"), "time points"), (("DIFFUSION", "NONE"), "directions or b-values of diffusion")],
)
def test_images_that_differ_only_in_numbers_are_noted_as_an_assumption(
    tmp_path: Path, words: tuple[str, ...], assumed: str
) -> None:
    for time in range(3):
        write_kind(tmp_path, 100 * time, image_type(*words), first_number=1 + 10 * time)
    note = f"3 images at a place: only InstanceNumber separates them, so {assumed} are assumed"
    assert note in notes_of(tmp_path)


def test_points_of_dynamic_pet_are_distinguished_by_their_time(tmp_path: Path) -> None:
    for time in (1, 0):
        change = setting(Modality="PT", FrameReferenceTime=1000.0 * time)
        write_kind(tmp_path, 100 * time, change, first_number=30 - 10 * time)
    assert [added(tmp_path, time=time) for time in (0, 1)] == [0, 100]
    assert "InstanceNumber" not in notes_of(tmp_path)


def test_b_values_of_a_sequence_name_separate_images(tmp_path: Path) -> None:
    for add, name in ((100, "*ep_b1000#1"), (0, "*ep_b0")):
        write_kind(tmp_path, add, setting(SequenceName=name))
    assert (added(tmp_path), added(tmp_path, 2)) == (0, 100)
    assert "(b 1000 s/mm2)" in notes_of(tmp_path)


def test_siemens_minimum_projection_is_left_out(tmp_path: Path) -> None:
    write_kind(tmp_path, 200, setting(ImageType=["DERIVED", "PRIMARY", "MNIP", "MNIP"]))
    write_kind(tmp_path, 100, image_type("M", "SWI"), first_number=50)
    assert "(minimum intensity projection)" in notes_of(tmp_path)


def test_slices_of_another_matrix_in_one_series_are_named(tmp_path: Path) -> None:
    write_series(tmp_path / "a", AFFINE, SHAPE, series="1.2.3", indices=range(4))
    fine = grid(shape=(10, 24, 28), spacing=(3.0, 1.0, 1.1))
    write_series(tmp_path / "b", fine, (10, 24, 28), series="1.2.3", indices=range(4, 10))
    note = (
        "4 more images of the same series lie beside these and are not built, because they differ "
        "in Columns"
    )
    assert note in notes_of(tmp_path)
    assert read.open(tmp_path).levels[0].shape == (24, 6, 28)


def write_dose(path: Path, **values: Any) -> None:
    pixels = np.rint(sample(AFFINE, SHAPE)).astype(np.uint16)
    ds = image(pixels[0], AFFINE, 0, slope=None)
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = RTDoseStorage
    ds.Modality, ds.NumberOfFrames = "RTDOSE", SHAPE[0]
    ds.GridFrameOffsetVector = [3.0 * k for k in range(SHAPE[0])]
    ds["PixelData"] = pydicom.DataElement("PixelData", "OW", pixels.tobytes())
    setting(**values)(ds)
    save(ds, path)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"DoseUnits": "GY", "DoseGridScaling": "0.001"}, "dose values are in gray"),
        ({"DoseUnits": "RELATIVE", "DoseGridScaling": "0.001"}, "relative to a reference"),
        ({"DoseUnits": "GY"}, "without a unit: DoseGridScaling is not stated"),
    ],
)
def test_the_unit_of_a_dose_is_named(tmp_path: Path, values: dict[str, Any], words: str) -> None:
    write_dose(tmp_path / "dose.dcm", **values)
    assert words in notes_of(tmp_path / "dose.dcm")
