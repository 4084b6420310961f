"""DICOM segmentations: told as label maps; a segment is read as a mask where it is asked for."""

from pathlib import Path
from typing import Any

import highdicom
import numpy as np
import pydicom
import pytest
from numpy.typing import NDArray
from pydicom.sr.codedict import codes

from stereocell import read
from stereocell.cli.__main__ import main
from support.dicom_reading import lps_mm, whole
from support.dicom_series import grid, write_series

SHAPE = (6, 9, 7)  # of 63 bits a plane, which fill no bytes
SPACING = (2.5, 2.0, 2.2)
AFFINE = grid(shape=SHAPE, spacing=SPACING)


def masks() -> NDArray[np.uint8]:
    """Two segments that overlap, in every plane: (slices, rows, columns, segments)."""
    both = np.zeros((*SHAPE, 2), np.uint8)
    both[:, 1:5, 1:4, 0] = 1
    both[:, 3:8, 2:6, 1] = 1
    both[2, 0, 6] = 1
    return both


def complete(ds: Any) -> None:
    """Add what a segmentation takes over from its images."""
    ds.PatientName, ds.PatientID, ds.PatientBirthDate, ds.PatientSex = "DOE^JANE", "J1", "", ""
    ds.StudyID, ds.StudyDate, ds.StudyTime, ds.AccessionNumber = "", "", "", ""
    ds.ReferringPhysicianName = ""
    ds.SliceThickness = ds.SpacingBetweenSlices = SPACING[0]


def write_segmentation(folder: Path, kind: str, voxels: NDArray[Any]) -> Path:
    files = write_series(folder / "images", AFFINE, SHAPE, change=complete)
    described = [
        highdicom.seg.SegmentDescription(
            number,
            f"left lung of JANE {number}",
            codes.SCT.Organ,
            codes.SCT.Lung,
            highdicom.seg.SegmentAlgorithmTypeValues.MANUAL,
        )
        for number in range(1, voxels.shape[-1] + 1)
    ]
    found = highdicom.seg.Segmentation(
        [pydicom.dcmread(path) for path in files],
        voxels,
        highdicom.seg.SegmentationTypeValues[kind],
        described,
        highdicom.UID(),
        1,
        highdicom.UID(),
        1,
        "maker",
        "model",
        "1",
        "0",
        omit_empty_frames=False,
    )
    path = folder / "seg.dcm"
    found.save_as(path)
    return path


def on_our_grid(voxels: NDArray[Any], dataset: read.Dataset) -> NDArray[Any]:
    """Return the voxels of stored planes at the places of the dataset's voxels."""
    step = np.linalg.inv(AFFINE)
    index = np.rint(lps_mm(dataset) @ step[:3, :3].T + step[:3, 3]).astype(int)
    return voxels[index[..., 0], index[..., 1], index[..., 2]]


@pytest.mark.parametrize("kind", ["BINARY", "FRACTIONAL", "LABELMAP"])
def test_a_segmentation_ends_the_plan_by_a_line_without_its_texts(
    tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    voxels = masks()
    if kind == "LABELMAP":
        voxels[..., 1] &= 1 - voxels[..., 0]
    path = write_segmentation(tmp_path, kind, voxels)
    assert main(["plan", str(path), "-o", str(tmp_path / "out")]) == 2
    told = capsys.readouterr()
    assert "is a label map: found a DICOM segmentation of 2 segments" in told.err
    assert "--as intensity" in told.err
    assert main(["plan", str(path), "-o", str(tmp_path / "out"), "--series", "list"]) == 0
    assert not {"JANE", "DOE", "lung"} & set(capsys.readouterr().out.replace("^", " ").split())
    assert "JANE" not in told.err


@pytest.mark.parametrize("kind", ["BINARY", "FRACTIONAL"])
def test_each_segment_is_a_mask_of_its_own(tmp_path: Path, kind: str) -> None:
    path = write_segmentation(tmp_path, kind, masks())
    lines = read.list_series(path)
    assert [line.split(", ")[1] for line in lines] == ["segment 1", "segment 2"]
    theirs = highdicom.seg.segread(path)
    for number in (1, 2):
        dataset = read.open(path, series=number)
        assert np.array_equal(whole(dataset) > 0, on_our_grid(masks()[..., number - 1], dataset))
        volume = theirs.get_volume(segment_numbers=[number], combine_segments=False)
        assert np.count_nonzero(volume.array) == np.count_nonzero(whole(dataset))


def test_the_image_is_built_where_its_segmentation_lies_beside_it(tmp_path: Path) -> None:
    write_segmentation(tmp_path, "BINARY", masks())
    dataset = read.open(tmp_path)
    assert (dataset.modality, dataset.labels) == ("MR", "")
    assert "3 series or orientations" in dataset.notes[0]


def test_a_segmentation_without_a_place_is_told_as_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_segmentation(tmp_path, "BINARY", masks())
    ds = pydicom.dcmread(path)
    for group in ds.PerFrameFunctionalGroupsSequence:
        del group.PlanePositionSequence
    ds.save_as(path)
    assert main(["plan", str(path), "-o", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert "of a segmentation of 2 segments, without a place in the patient" in told
    assert "expected the image that it was drawn on" in told
