"""Headers of NIfTI, Analyze and MGH that state one thing twice: the note, and the value used."""

import gzip
import struct
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest
import SimpleITK as sitk
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.errors import SourceError
from support.dicom_reading import whole
from support.phantoms import f_phantom

SPACING = (0.5, 0.7, 2.0)  # voxel spacing, mm, along x, y, z as stored
# positions in the header of NIfTI-1, in bytes
PIXDIM, SLOPE, UNITS, QFORM_CODE, QUATERN, SROW = 76, 112, 123, 252, 256, 280


def write(path: Path, spacing: tuple[float, ...] = SPACING) -> Path:
    """Write the phantom with SimpleITK, which states the same in sform, qform and pixdim."""
    image = sitk.GetImageFromArray(f_phantom().astype(np.int16))
    image.SetSpacing(spacing)
    sitk.WriteImage(image, str(path))
    return path


def patch(path: Path, start: int, values: NDArray[Any]) -> Path:
    content = bytearray(path.read_bytes())
    content[start : start + values.nbytes] = values.tobytes()
    path.write_bytes(content)
    return path


def set_sform(path: Path, affine: NDArray[np.float64]) -> Path:
    return patch(path, SROW, affine[:3].astype("<f4"))


def ras(*signs_and_sizes: float) -> NDArray[np.float64]:
    return np.diag([*signs_and_sizes, 1.0])


def test_forms_that_agree_need_no_note(tmp_path: Path) -> None:
    assert read.open(write(tmp_path / "a.nii")).notes == ()


def test_an_sform_without_the_voxel_size_is_reported(tmp_path: Path) -> None:
    path = set_sform(write(tmp_path / "a.nii"), ras(-1.0, -1.0, 1.0))
    (note,) = read.open(path).notes
    assert note == (
        "voxel spacing along the stored axes: sform states 1, 1, 1 mm, pixdim (and qform) states "
        "0.5, 0.7, 2 mm: sform is used; --spacing-um z,y,x replaces it"
    )


@pytest.mark.parametrize(
    ("affine", "sform"),
    [
        (ras(0.5, -0.7, 2.0), "R, P, S"),  # left and right exchanged
        (ras(-0.5, -0.7, -2.0), "L, P, I"),
        (ras(-0.5, -0.7, 2.0)[:, [1, 0, 2, 3]], "P, L, S"),  # axes exchanged
    ],
)
def test_forms_that_run_in_other_directions_are_reported(
    tmp_path: Path, affine: NDArray[np.float64], sform: str
) -> None:
    path = set_sform(write(tmp_path / "a.nii"), affine)
    notes = read.open(path).notes
    assert any(
        f"stored axes run: sform states {sform}, qform states L, P, S: sform is used" in note
        for note in notes
    )


def test_forms_that_are_rotated_to_each_other_are_reported(tmp_path: Path) -> None:
    angle = np.radians(12.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0]])
    affine = ras(-0.5, -0.7, 2.0)
    affine[:2, :3] = turn @ affine[:3, :3]
    path = set_sform(write(tmp_path / "a.nii"), affine)
    (note,) = read.open(path).notes
    assert note == "orientation: sform and qform differ by 12 degrees: sform is used"


def test_an_sform_of_zeros_is_skipped(tmp_path: Path) -> None:
    expected = read.open(write(tmp_path / "a.nii"))
    dataset = read.open(set_sform(write(tmp_path / "b.nii"), np.zeros((4, 4))))
    np.testing.assert_array_equal(whole(dataset), whole(expected))
    assert dataset.levels == expected.levels
    assert dataset.placement == expected.placement
    assert dataset.notes == ("sform: its axes don't span three dimensions: qform is used",)


def test_a_missing_unit_is_an_assumption_with_its_remedy(tmp_path: Path) -> None:
    dataset = read.open(patch(write(tmp_path / "a.nii"), UNITS, np.zeros(1, "u1")))
    assert dataset.notes == (
        "unit of length: not stated, mm is assumed, as in most programs for NIfTI; "
        "--spacing-um z,y,x replaces it",
    )


@pytest.mark.parametrize(
    ("spacing", "words"),
    [
        ((25.0, 25.0, 25.0), "found 25 mm along the finest axis"),
        ((0.0005, 0.0005, 0.002), "found 0.032 mm across the whole volume"),
    ],
)
def test_sizes_that_no_scanner_has_are_reported(
    tmp_path: Path, spacing: tuple[float, ...], words: str
) -> None:
    (note,) = read.open(write(tmp_path / "a.nii", spacing)).notes
    assert words in note
    assert "is its unit wrong?" in note


@pytest.mark.parametrize("slope", [0, np.nan])
def test_an_intercept_that_the_slope_turns_off_is_reported(tmp_path: Path, slope: float) -> None:
    path = patch(write(tmp_path / "a.nii"), SLOPE, np.array([slope, 1000], "<f4"))
    dataset = read.open(path)
    assert whole(dataset).max() == f_phantom().max()
    assert dataset.notes == (
        f"values: scl_slope {slope:g} states that they are not scaled: scl_inter 1000 is left out",
    )


def test_a_quaternion_that_is_not_a_rotation_is_left_out_or_named(tmp_path: Path) -> None:
    impossible = np.array([0.9, 0.9], "<f4")
    path = patch(write(tmp_path / "a.nii"), QUATERN, impossible)
    assert "qform: its axes don't span three dimensions: sform is used" in read.open(path).notes
    image = nibabel.Nifti1Image(f_phantom().astype(np.int16), np.diag([2.0, 2, 2, 1]))
    image.set_qform(image.affine, 1)
    image.set_sform(None, 0)
    nibabel.save(image, tmp_path / "b.nii")
    with pytest.raises(SourceError, match="quatern_b, quatern_c, quatern_d: found squares"):
        read.open(patch(tmp_path / "b.nii", QUATERN, impossible))


def test_an_intercept_that_is_not_a_number_is_refused_with_its_field(tmp_path: Path) -> None:
    path = patch(write(tmp_path / "a.nii"), SLOPE, np.array([2, np.nan], "<f4"))
    with pytest.raises(SourceError, match="scl_inter: found no finite number beside scl_slope"):
        read.open(path)


def test_a_fourth_axis_of_frequencies_is_not_time(tmp_path: Path) -> None:
    image = nibabel.Nifti1Image(np.zeros((4, 5, 6, 3), np.uint8), np.diag([2.0, 2, 2, 1]))
    image.header.set_xyzt_units("mm", "ppm")
    nibabel.save(image, tmp_path / "a.nii")
    assert "axis t: xyzt_units states ppm, so its 3 volumes are not time points" in (
        read.open(tmp_path / "a.nii").notes
    )


def test_spm_s_matrix_that_contradicts_the_header_is_reported(tmp_path: Path) -> None:
    image = nibabel.Spm99AnalyzeImage(f_phantom().astype(np.int16), np.diag([-2.0, 2, 2, 1]))
    nibabel.save(image, tmp_path / "a.img")
    assert not any("spacing" in note for note in read.open(tmp_path / "a.img").notes)
    patch(tmp_path / "a.hdr", PIXDIM + 4, np.array([1, 1, 3], "<f4"))
    dataset = read.open(tmp_path / "a.img")
    assert any(
        "the matrix of SPM (.mat) states 2, 2, 2 mm, pixdim states 1, 1, 3 mm" in note
        for note in dataset.notes
    )
    assert dataset.levels[0].spacing_um == (2000, 2000, 2000)


def mgh(voxels_zyx: NDArray[Any], kind: int, *, is_placed: bool = True) -> bytes:
    """Return a file of MGH, byte by byte after FreeSurfer's page on the format."""
    depth, height, width = voxels_zyx.shape
    head = struct.pack(">7i", 1, width, height, depth, 1, kind, 0)
    head += struct.pack(">h", int(is_placed))
    head += struct.pack(">3f", *SPACING)
    head += struct.pack(">9f", -1, 0, 0, 0, -1, 0, 0, 0, 1)  # x to the left, y back, z up, in RAS
    head += struct.pack(">3f", 0, 0, 0)
    behind = struct.pack(">5f", 2000, 0.1, 3, 900, 256) + b"mri_convert /home/JANE_DOE.dcm"
    return head.ljust(284, b"\0") + voxels_zyx.tobytes() + behind


@pytest.mark.parametrize("ending", [".mgh", ".mgz", ".MGZ", ".mgh.gz"])
@pytest.mark.parametrize(
    ("kind", "dtype"), [(0, ">u1"), (1, ">i4"), (3, ">f4"), (4, ">i2"), (10, ">u2")]
)
def test_freesurfer_s_volumes_lie_as_their_header_states(
    tmp_path: Path, ending: str, kind: int, dtype: str
) -> None:
    content = mgh((f_phantom() // 10).astype(dtype), kind)
    packed = content if ending == ".mgh" else gzip.compress(content)
    (tmp_path / f"jane{ending}").write_bytes(packed)
    dataset = read.open(tmp_path / f"jane{ending}")
    image = sitk.GetImageFromArray((f_phantom() // 10).astype(np.int16))
    image.SetSpacing(SPACING)
    sitk.WriteImage(image, str(tmp_path / "b.nii"))
    np.testing.assert_array_equal(whole(dataset), whole(read.open(tmp_path / "b.nii")))
    assert dataset.levels[0].spacing_um == pytest.approx((700, 2000, 500))
    assert dataset.name == "MGH"
    assert dataset.has_sides
    assert "JANE" not in f"{dataset.notes}{dataset.channels}"


def test_a_volume_of_freesurfer_without_a_place_is_an_assumption(tmp_path: Path) -> None:
    (tmp_path / "a.mgh").write_bytes(mgh(f_phantom().astype(">u2"), 10, is_placed=False))
    dataset = read.open(tmp_path / "a.mgh")
    assert not dataset.has_sides
    assert any("goodRASFlag 0" in note and "1 mm are assumed" in note for note in dataset.notes)
    assert dataset.levels[0].spacing_um == (1000, 1000, 1000)


@pytest.mark.parametrize("size", [0, 50, 284, 2000])
@pytest.mark.parametrize("ending", [".mgh", ".mgz"])
def test_a_volume_of_freesurfer_that_is_cut_short_is_refused(
    tmp_path: Path, ending: str, size: int
) -> None:
    content = mgh(f_phantom().astype(">u2"), 10)[:size]
    path = tmp_path / f"a{ending}"
    path.write_bytes(content if ending == ".mgh" else gzip.compress(content))
    with pytest.raises(SourceError, match="expected") as caught:
        whole(read.open(path))
    assert "\n" not in str(caught.value)
