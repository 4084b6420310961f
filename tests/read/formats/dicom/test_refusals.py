"""A file that is not a slice is refused with its kind and a remedy."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pydicom
import pytest

from stereocell import read
from support.dicom_reading import whole
from support.dicom_series import grid, image, save, write_enhanced
from support.reading import refusing

SHAPE = (4, 8, 9)
CLASSES = "1.2.840.10008.5.1.4.1.1."


refusal = refusing(read.open)


@pytest.mark.parametrize(
    ("sop_class", "words"),
    [
        ("481.3", "an RT structure set holds contours but no voxels: name the folder of the"),
        ("481.5", "an RT plan holds no voxels"),
        ("88.67", "a dose report holds no image"),
        ("88.11", "a structured report holds no image"),
        ("104.1", "an encapsulated document holds no image"),
        ("104.3", "an encapsulated mesh holds no voxels"),
        ("9.1.1", "a waveform is not an image"),
        ("11.1", "a presentation state describes how to show other images"),
        ("66.1", "describes other images"),
    ],
)
def test_files_without_pixels_are_named_by_their_kind_with_a_remedy(
    tmp_path: Path, sop_class: str, words: str
) -> None:
    ds = image(np.zeros((8, 9), np.int16), grid(), 0)
    del ds.PixelData, ds.Rows, ds.Columns, ds.ImagePositionPatient
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = CLASSES + sop_class
    assert words in refusal(save(ds, tmp_path / "a"))
    assert words in refusal(tmp_path)


@pytest.mark.parametrize(
    ("sop_class", "image_type", "words"),
    [
        ("7", ["DERIVED", "SECONDARY", "OTHER"], "a secondary capture, such as a dose sheet"),
        ("2", ["ORIGINAL", "PRIMARY", "OTHER", "CT_SOM5 PROT"], "a dose or protocol sheet is"),
        ("2", ["DERIVED", "SECONDARY", "SCREEN SAVE"], "a screen save is an image of a screen"),
        ("2", ["ORIGINAL", "PRIMARY", "LOCALIZER"], "a localizer (scout) without a place"),
        ("1.1", ["ORIGINAL", "PRIMARY"], "a radiograph is a projection"),
        ("481.2", ["DERIVED", "SECONDARY"], "an RT dose needs GridFrameOffsetVector"),
        ("2", ["ORIGINAL", "PRIMARY", "AXIAL"], "export the original slices, with ImagePosition"),
    ],
)
def test_images_without_a_position_are_named_by_their_kind_with_a_remedy(
    tmp_path: Path, sop_class: str, image_type: list[str], words: str
) -> None:
    ds = image(np.zeros((8, 9), np.int16), grid(), 0)
    del ds.ImagePositionPatient, ds.ImageOrientationPatient
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = CLASSES + sop_class
    ds.ImageType = image_type
    assert words in refusal(save(ds, tmp_path / "a"))


def test_a_spacing_as_in_radiographs_is_reported_as_that_of_the_detector(tmp_path: Path) -> None:
    ds = image(np.zeros((8, 9), np.int16), grid(), 0)
    del ds.PixelSpacing
    ds.ImagerPixelSpacing = [1.0, 1.0]
    assert "ImagerPixelSpacing holds at the detector" in refusal(save(ds, tmp_path / "a"))


def changed(path: Path, change: Callable[[pydicom.Dataset], None]) -> Path:
    ds = pydicom.dcmread(write_enhanced(path, grid(shape=SHAPE), SHAPE, seed=None))
    change(ds)
    ds.save_as(path)
    return path


@pytest.mark.parametrize("stated", [3, 6])
def test_all_frames_are_read_if_groups_and_pixels_agree_on_their_number(
    tmp_path: Path, stated: int
) -> None:
    right = whole(read.open(changed(tmp_path / "a", lambda ds: None)))
    path = changed(tmp_path / "b", lambda ds: setattr(ds, "NumberOfFrames", stated))
    dataset = read.open(path)
    assert np.array_equal(whole(dataset), right)
    words = f"PerFrameFunctionalGroupsSequence states 4, NumberOfFrames states {stated}"
    assert any(words in note for note in dataset.notes)


def test_pixels_beyond_the_stated_frames_are_noted(tmp_path: Path) -> None:
    def change(ds: pydicom.Dataset) -> None:
        ds.PixelData = ds.PixelData * 2

    dataset = read.open(changed(tmp_path / "a", change))
    assert dataset.levels[0].shape == (8, 4, 9)
    assert any("the pixel data states 8: NumberOfFrames is used" in n for n in dataset.notes)
