"""The affine of every series agrees with dicom2nifti's, ITK's and nibabel's within 1e-4 mm.

The columns of the matrix from (slice, row, column) to LPS are compared, each in mm per step.
"""

import os
import warnings
from pathlib import Path

import nibabel
import numpy as np
import pydicom
import pytest
import SimpleITK as sitk
from dicom2nifti import common
from numpy.typing import NDArray

from stereocell.read.formats.dicom.image import _find
from stereocell.read.plane_stack import StackLayout
from stereocell.storage.location import Location
from support.dicom_series import grid, tilted, turn, write_enhanced, write_series

SHAPE = (22, 30, 26)
OBLIQUE = turn((1, 2, -0.5), 23.0)
TOLERANCE_MM = 1e-4
RAS_TO_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])


def layout_of(source: Path) -> StackLayout:
    layout = _find(Location.of(source)).stacks[0].layout
    assert layout is not None
    return layout


def by_dicom2nifti(files: list[Path]) -> NDArray[np.float64]:
    """Return dicom2nifti's affine, from (column, row, slice) to LPS, without flips."""
    headers = common.sort_dicoms([pydicom.dcmread(file) for file in files])
    affine, _ = common.create_affine(headers)
    return RAS_TO_LPS @ affine


def by_itk(files: list[Path]) -> NDArray[np.float64]:
    """Return ITK's affine, from (column, row, slice) to LPS.

    files  sorted by their positions along the slices' normal
    """
    image = sitk.ReadImage([str(file) for file in files] if len(files) > 1 else str(files[0]))
    affine = np.eye(4)
    affine[:3, :3] = np.reshape(image.GetDirection(), (3, 3)) * image.GetSpacing()
    affine[:3, 3] = image.GetOrigin()
    return affine


def by_nibabel(file: Path) -> NDArray[np.float64]:
    """Return nibabel's affine of an enhanced file, from (row, column, slice) to LPS."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # nibabel warns that its DICOM part is experimental
        from nibabel.nicom.dicomwrappers import wrapper_from_file
    return np.asarray(wrapper_from_file(str(file)).affine, np.float64)


def along_normal(files: list[Path]) -> list[Path]:
    def place(file: Path) -> float:
        header = pydicom.dcmread(file, stop_before_pixels=True)
        x, y = np.reshape(np.array(header.ImageOrientationPatient, float), (2, 3))
        return float(np.cross(x, y) @ np.array(header.ImagePositionPatient, float))

    return sorted(files, key=place)


def to_ours(affine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convert an affine from (column, row, slice) to one from our (slice, row, column)."""
    return affine[:, [2, 1, 0, 3]]


def difference(ours: NDArray[np.float64], theirs: NDArray[np.float64]) -> float:
    """Return the largest difference of any entry of two affines, in mm.

    If the other program stacks the slices in the opposite order, its affine is reversed first.
    """
    theirs = theirs.copy()
    if theirs[:3, 0] @ ours[:3, 0] < 0:
        theirs[:3, 3] += (SHAPE[0] - 1) * theirs[:3, 0]
        theirs[:3, 0] *= -1
    return float(np.abs(ours - theirs).max())


SERIES = {
    "axial": grid(),
    "oblique axial": grid(rotation=OBLIQUE),
    "oblique coronal": grid("coronal", rotation=OBLIQUE),
    "oblique sagittal": grid("sagittal", rotation=OBLIQUE, spacing=(0.7, 0.35, 0.4)),
    "tilted by 18 degrees": tilted(grid(rotation=OBLIQUE), SHAPE, 18),
}


@pytest.mark.parametrize("name", SERIES)
def test_single_frame_series_agree_with_dicom2nifti_and_the_truth(
    tmp_path: Path, name: str
) -> None:
    files = write_series(tmp_path / "s", SERIES[name])
    ours = layout_of(tmp_path / "s").stack  # before the resampling that a tilt needs
    assert difference(ours, to_ours(by_dicom2nifti(files))) < TOLERANCE_MM
    assert difference(ours, SERIES[name]) < TOLERANCE_MM


@pytest.mark.parametrize("name", [name for name in SERIES if "tilted" not in name])
def test_single_frame_series_agree_with_itk(tmp_path: Path, name: str) -> None:
    files = write_series(tmp_path / "s", SERIES[name])
    theirs = to_ours(by_itk(along_normal(files)))
    assert difference(layout_of(tmp_path / "s").affine, theirs) < TOLERANCE_MM


def test_series_with_missing_slices_has_the_affine_of_the_complete_one(tmp_path: Path) -> None:
    affine = grid("coronal", rotation=OBLIQUE)
    write_series(tmp_path / "all", affine)
    write_series(tmp_path / "some", affine, indices=[k for k in range(22) if k not in (4, 9, 10)])
    whole, some = layout_of(tmp_path / "all"), layout_of(tmp_path / "some")
    assert some.shape == whole.shape
    assert difference(whole.affine, some.affine) < TOLERANCE_MM
    files = along_normal(list((tmp_path / "all").iterdir()))
    assert difference(some.affine, to_ours(by_itk(files))) < TOLERANCE_MM


@pytest.mark.parametrize("modality", ["MR", "CT"])
def test_enhanced_images_agree_with_itk_and_nibabel(tmp_path: Path, modality: str) -> None:
    affine = grid("axial", rotation=OBLIQUE)
    shuffled = write_enhanced(tmp_path / "a.dcm", affine, SHAPE, modality)
    in_order = write_enhanced(tmp_path / "b.dcm", affine, SHAPE, modality, seed=None)
    ours = layout_of(shuffled).affine
    assert difference(ours, affine) < TOLERANCE_MM
    # the other readers keep the order of frames
    assert difference(ours, to_ours(by_itk([in_order]))) < TOLERANCE_MM
    if modality == "MR":  # nibabel doesn't read enhanced CT
        assert difference(ours, by_nibabel(in_order)[:, [2, 0, 1, 3]]) < TOLERANCE_MM


@pytest.mark.slow
@pytest.mark.skipif("STEREOCELL_DATA" not in os.environ, reason="STEREOCELL_DATA is not set")
def test_real_series_agrees_with_dicom2nifti_and_itk() -> None:
    folder = Path(os.environ["STEREOCELL_DATA"]) / "mri_t1_7t" / "dicoms"
    files = sorted(folder.iterdir())
    ours = layout_of(folder)
    assert difference(ours.affine, to_ours(by_itk(along_normal(files)))) < TOLERANCE_MM
    theirs = to_ours(by_dicom2nifti(files))
    assert difference(ours.stack, theirs) < TOLERANCE_MM
    assert nibabel.aff2axcodes(RAS_TO_LPS @ ours.affine) == ("S", "P", "L")
