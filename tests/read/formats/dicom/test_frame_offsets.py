"""RT Dose and NM: the position of the first plane of a multi-frame image gives all others."""

from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk
from pydicom.uid import (
    NuclearMedicineImageStorage,
    RTDoseStorage,
    SecondaryCaptureImageStorage,
    UltrasoundMultiFrameImageStorage,
)

from stereocell import read
from stereocell.model.errors import SourceError
from support.dicom_reading import error, lps_mm, whole
from support.dicom_series import grid, image, sample, save, turn

SHAPE = (9, 18, 20)
SCALING = 0.25


def write_dose(path: Path, affine: np.ndarray[Any, Any], offsets: str = "relative") -> Path:
    """Write the scene as RT Dose.

    offsets  "relative": distances of the planes from the first; "absolute": positions along z
    """
    stored = np.rint(sample(affine, SHAPE) / SCALING).astype(np.uint32)
    ds = image(stored[0], affine, 0, slope=None)
    ds.PixelData = stored.tobytes()
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = RTDoseStorage
    ds.Modality, ds.DoseGridScaling, ds.NumberOfFrames = "RTDOSE", SCALING, SHAPE[0]
    normal = np.cross(affine[:3, 2], affine[:3, 1])
    normal /= np.linalg.norm(normal)
    along = np.arange(SHAPE[0]) * (normal @ affine[:3, 0])
    if offsets == "absolute":
        along = affine[2, 3] + np.arange(SHAPE[0]) * affine[2, 0]
    ds.GridFrameOffsetVector = [f"{value:.8g}" for value in along]
    ds.FrameIncrementPointer = 0x3004000C
    return save(ds, path)


@pytest.mark.parametrize("offsets", ["relative", "absolute"])
@pytest.mark.parametrize("turned", [None, "down", "over"])
def test_every_dose_lies_at_its_position_in_the_scene(
    tmp_path: Path, offsets: str, turned: str | None
) -> None:
    affine = grid(shape=SHAPE, spacing=(3.0, 2.0, 2.0))
    if turned == "down":  # from the last plane to the first
        affine[:3, 3] += affine[:3, 0] * (SHAPE[0] - 1)
        affine[:3, 0] *= -1
    elif turned == "over":  # prone: rows and slices run in the opposite direction
        affine = grid(shape=SHAPE, spacing=(3.0, 2.0, 2.0), rotation=turn((1, 0, 0), 180))
    dataset = read.open(write_dose(tmp_path / "d.dcm", affine, offsets))
    assert error(dataset) <= SCALING / 2 + 1e-3
    assert (dataset.modality, dataset.dtype) == ("RTDOSE", np.float32)


def test_itk_reads_the_same_doses_at_the_same_positions(tmp_path: Path) -> None:
    path = write_dose(tmp_path / "d.dcm", grid(shape=SHAPE, spacing=(3.0, 2.0, 2.0)))
    dataset, theirs = read.open(path), sitk.ReadImage(path)
    stored = sitk.GetArrayFromImage(theirs)  # before scaling
    points = lps_mm(dataset)
    index = [
        theirs.TransformPhysicalPointToIndex(point) for point in points.reshape(-1, 3).tolist()
    ]
    x, y, z = np.transpose(index)
    assert np.allclose(whole(dataset).ravel(), stored[z, y, x] * SCALING, rtol=1e-6)


def test_absolute_positions_of_oblique_planes_are_refused(tmp_path: Path) -> None:
    affine = grid(shape=SHAPE, rotation=turn((1, 2, 3), 20))
    with pytest.raises(SourceError, match=r"no place for each \(RT Dose Storage\)"):
        read.open(write_dose(tmp_path / "d.dcm", affine, "absolute"))


def write_nm(path: Path, affine: np.ndarray[Any, Any], **values: Any) -> Path:
    """Write reconstructed slices; the detector states the position of the first one."""
    stored = np.rint(sample(affine, SHAPE)).astype(np.uint16)
    ds = image(stored[0], affine, 0, slope=None)
    ds.PixelData = stored.tobytes()
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = NuclearMedicineImageStorage
    detector = pydicom.Dataset()
    detector.ImagePositionPatient = ds.ImagePositionPatient
    detector.ImageOrientationPatient = ds.ImageOrientationPatient
    del ds.ImagePositionPatient, ds.ImageOrientationPatient
    ds.DetectorInformationSequence = [detector]
    ds.ImageType = ["ORIGINAL", "PRIMARY", "RECON TOMO", "EMISSION"]
    ds.Modality, ds.NumberOfFrames = "NM", SHAPE[0]
    normal = np.cross(affine[:3, 2], affine[:3, 1])
    ds.SpacingBetweenSlices = float(affine[:3, 0] @ normal / np.linalg.norm(normal))
    ds.SliceVector, ds.FrameIncrementPointer = list(range(1, SHAPE[0] + 1)), 0x00540080
    for name, value in values.items():
        setattr(ds, name, value)
    return save(ds, path)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("downwards", [False, True])
def test_slices_of_nuclear_medicine_are_stacked_by_the_sign_of_their_spacing(
    tmp_path: Path, turned: bool, downwards: bool
) -> None:
    rotation = turn((1, 2, -0.5), 23.0) if turned else None
    affine = grid(shape=SHAPE, spacing=(3.0, 2.0, 2.0), rotation=rotation)
    if downwards:
        affine[:3, 3] += affine[:3, 0] * (SHAPE[0] - 1)
        affine[:3, 0] *= -1
    path = write_nm(tmp_path / "n.dcm", affine)
    dataset = read.open(path)
    assert error(dataset) < 0.51
    assert dataset.modality == "NM"
    if not downwards:  # ITK doesn't accept a spacing below 0
        theirs = sitk.ReadImage(path)
        points = lps_mm(dataset).reshape(-1, 3).tolist()
        x, y, z = np.transpose([theirs.TransformPhysicalPointToIndex(point) for point in points])
        assert np.array_equal(whole(dataset).ravel(), sitk.GetArrayFromImage(theirs)[z, y, x])


@pytest.mark.parametrize(
    "values",
    [
        {"ImageType": ["ORIGINAL", "PRIMARY", "TOMO", "EMISSION"]},  # projections
        {"SliceVector": [1, 2, 3] * 3},  # of several energies or phases
        {"SpacingBetweenSlices": 0, "SliceThickness": 0},
    ],
)
def test_other_frames_of_nuclear_medicine_are_refused(
    tmp_path: Path, values: dict[str, Any]
) -> None:
    path = write_nm(tmp_path / "n.dcm", grid(shape=SHAPE), **values)
    with pytest.raises(SourceError, match=r"for each \(Nuclear Medicine Image Storage\)"):
        read.open(path)


@pytest.mark.parametrize(
    ("kind", "frames", "expected"),
    [
        (
            SecondaryCaptureImageStorage,
            1,
            "without a place in the patient (Secondary Capture Image",
        ),
        (UltrasoundMultiFrameImageStorage, 3, "no place for each (Ultrasound Multi-frame Image"),
        ("1.2.3.4.5", 1, "without a place in the patient, expected"),
    ],
)
def test_an_image_without_a_position_is_named_by_its_kind(
    tmp_path: Path, kind: str, frames: int, expected: str
) -> None:
    ds = image(np.zeros((8, 8), np.uint8), grid(), 0)
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = kind
    del ds.ImagePositionPatient, ds.ImageOrientationPatient
    if frames > 1:
        ds.NumberOfFrames, ds.PixelData = frames, bytes(64 * frames)
    path = save(ds, tmp_path / "s.dcm")
    with pytest.raises(SourceError) as caught:
        read.open(path)
    assert expected in str(caught.value)
    assert "found one file, " in str(caught.value)
