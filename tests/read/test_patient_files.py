"""NRRD, MetaImage and Analyze, written by SimpleITK, pynrrd and nibabel: where each voxel lies."""

import bz2
import os
from pathlib import Path
from typing import Any

import nibabel
import nrrd
import numpy as np
import pytest
import SimpleITK as sitk
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.rigid_transform import IDENTITY
from stereocell.model.tiling import Box
from support.dicom_reading import error, whole
from support.dicom_series import grid, sample, tilted, turn
from support.phantoms import f_phantom
from support.reading import read_voxels, refusing

SHAPE = (22, 30, 26)
OBLIQUE = turn((1, 2, -0.5), 23.0)
SUFFIXES = [".mha", ".mhd", ".nrrd", ".nhdr"]


def scene_on(affine: NDArray[np.float64], dtype: Any = np.int16) -> NDArray[Any]:
    return np.rint(sample(affine, SHAPE)).astype(dtype)


def write(path: Path, affine: NDArray[np.float64], voxels: Any, *, compress: bool = False) -> Path:
    """Write (i, j, k) voxels, or (i, j, k, c), with an affine to LPS, with SimpleITK."""
    order = (2, 1, 0, 3)[: voxels.ndim]
    image = sitk.GetImageFromArray(voxels.transpose(order), isVector=voxels.ndim == 4)
    lengths = np.linalg.norm(affine[:3, :3], axis=0)
    image.SetSpacing(lengths.tolist())
    image.SetDirection((affine[:3, :3] / lengths).ravel().tolist())
    image.SetOrigin(affine[:3, 3].tolist())
    sitk.WriteImage(image, str(path), useCompression=compress)
    return path


refusal = refusing(read_voxels)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("plane", ["axial", "sagittal", "coronal"])
def test_every_voxel_lies_where_the_scene_has_it(
    tmp_path: Path, suffix: str, compress: bool, plane: str
) -> None:
    affine = grid(plane, rotation=OBLIQUE, shift=(4, -3, 2))
    path = write(tmp_path / f"Jane Doe's{suffix}", affine, scene_on(affine), compress=compress)
    dataset = read.open(path)
    assert error(dataset) < 0.55  # whole numbers
    assert dataset.name in ("NRRD", "MetaImage")  # the file's name may be a patient's
    assert len(dataset.notes) == (dataset.name == "NRRD")  # ITK states no unit in NRRD
    assert dataset.dtype == np.int16


@pytest.mark.parametrize("suffix", [".mha", ".nrrd"])
def test_a_left_handed_grid_is_not_mirrored(tmp_path: Path, suffix: str) -> None:
    affine = grid("coronal", rotation=OBLIQUE)
    affine[:3, 3] += (SHAPE[2] - 1) * affine[:3, 2]
    affine[:3, 2] *= -1
    assert error(read.open(write(tmp_path / f"a{suffix}", affine, scene_on(affine)))) <= 0.51


@pytest.mark.parametrize("suffix", [".mha", ".nrrd"])
def test_a_window_equals_that_part_of_the_whole(tmp_path: Path, suffix: str) -> None:
    affine = grid("sagittal")
    dataset = read.open(write(tmp_path / f"a{suffix}", affine, scene_on(affine)))
    box = Box((3, 2, 5), (11, 14, 17))
    np.testing.assert_array_equal(dataset.read(0, box).voxels, whole(dataset)[box.slices])


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_several_values_per_voxel_are_channels(tmp_path: Path, suffix: str) -> None:
    affine = grid()
    both = np.stack([scene_on(affine), scene_on(affine) + 7], axis=-1)
    dataset = read.open(write(tmp_path / f"a{suffix}", affine, both))
    assert len(dataset.channels) == 2
    assert error(dataset) <= 0.51
    box = dataset.levels[0].box
    np.testing.assert_array_equal(dataset.read(1, box).voxels, dataset.read(0, box).voxels + 7)


@pytest.mark.parametrize("suffix", [".mha", ".nrrd"])
def test_time_points_are_chosen(tmp_path: Path, suffix: str) -> None:
    voxels = np.stack([f_phantom(), f_phantom() + 9])
    if suffix == ".nrrd":
        header = {"space": "left-posterior-superior-time", "kinds": ["domain"] * 3 + ["time"]}
        header |= {"space directions": [[1, 0, 0], [0, 1, 0], [0, 0, 1], [np.nan] * 3]}  # type: ignore[dict-item]
        nrrd.write(str(tmp_path / "a.nrrd"), voxels, header, index_order="C")
    else:
        sitk.WriteImage(sitk.GetImageFromArray(voxels, isVector=False), str(tmp_path / "a.mha"))
    first, second = (read.open(tmp_path / f"a{suffix}", time=t) for t in (0, 1))
    assert second.time_points == 2
    np.testing.assert_array_equal(whole(second), whole(first) + 9)


@pytest.mark.parametrize(
    ("space", "signs"),
    [
        ("left-posterior-superior", (1, 1, 1)),
        ("RAS", (-1, -1, 1)),
        ("left-anterior-superior", (1, -1, 1)),
    ],
)
@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2"])
@pytest.mark.parametrize("endian", ["<", ">"])
def test_nrrd_spaces_encodings_and_byte_orders(
    tmp_path: Path, space: str, signs: tuple[int, ...], encoding: str, endian: str
) -> None:
    affine = grid("coronal", rotation=OBLIQUE, shift=(1, 2, 3))
    own = np.diag([*signs, 1]) @ affine
    header = {"space": space, "space directions": own[:3, :3].T, "space origin": own[:3, 3]}
    header |= {"encoding": encoding, "patient": "Jane Doe"}
    nrrd.write(str(tmp_path / "a.nrrd"), scene_on(affine, f"{endian}i2"), header)
    dataset = read.open(tmp_path / "a.nrrd")
    assert error(dataset) <= 0.51
    assert dataset.dtype == np.int16
    assert "Jane" not in f"{dataset.name} {dataset.notes} {dataset.channels}"


@pytest.mark.parametrize("files", ["LIST\na.raw\nb.raw", "list 2\na.raw", "a%02d.raw 1 9 1"])
def test_a_nrrd_whose_voxels_lie_in_several_files_is_refused(tmp_path: Path, files: str) -> None:
    head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 4 2\nspacings: 1 1 1\nencoding: raw\n"
    (tmp_path / "a.nhdr").write_text(f"{head}data file: {files}\n")
    assert "data file: found a list of files, expected one" in refusal(tmp_path / "a.nhdr")


def test_a_nrrd_without_anatomical_axes_is_a_stack_as_stored(tmp_path: Path) -> None:
    header = {"space dimension": 3, "space units": ["microns"] * 3}
    header |= {"space directions": np.diag([0.25, 0.2, 0.5])}  # type: ignore[dict-item]
    nrrd.write(str(tmp_path / "My brain.nrrd"), f_phantom(), header, index_order="C")
    dataset = read.open(tmp_path / "My brain.nrrd")
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.25))
    assert (dataset.name, dataset.placement) == ("My brain", IDENTITY)
    nrrd.write(str(tmp_path / "b.nrrd"), f_phantom(), {"spacings": [1, 1, 1]}, index_order="C")
    assert "--spacing-um" in refusal(tmp_path / "b.nrrd")


def test_skew_axes_are_resampled(tmp_path: Path) -> None:
    affine = tilted(grid(rotation=OBLIQUE), SHAPE, 12)
    header = {"space": "LPS", "space directions": affine[:3, :3].T, "space origin": affine[:3, 3]}
    nrrd.write(str(tmp_path / "a.nrrd"), scene_on(affine), header)
    nifti = nibabel.Nifti1Image(scene_on(affine), np.diag([-1, -1, 1, 1]) @ affine)
    nifti.header.set_xyzt_units("mm")
    nibabel.save(nifti, tmp_path / "a.nii")
    dataset = read.open(tmp_path / "a.nrrd")
    assert any("skew axes" in note for note in dataset.notes)
    np.testing.assert_allclose(whole(dataset), whole(read.open(tmp_path / "a.nii")), atol=1)


@pytest.mark.parametrize("kind", ["nifti pair", "analyze", "spm"])
@pytest.mark.parametrize("named", ["a.hdr", "a.img", "A.HDR"])
def test_pairs_are_read_by_either_name(tmp_path: Path, kind: str, named: str) -> None:
    affine = grid()
    ras = np.diag([-1.0, -1.0, 1.0, 1.0]) @ affine
    make = {
        "nifti pair": nibabel.Nifti1Pair,
        "analyze": nibabel.AnalyzeImage,
        "spm": nibabel.Spm99AnalyzeImage,
    }[kind]
    image = make(scene_on(affine), ras)
    if kind == "nifti pair":
        image.header.set_xyzt_units("mm")
    nibabel.save(image, tmp_path / "a.img")
    if named == "A.HDR":
        for file in list(tmp_path.iterdir()):
            file.rename(file.with_name(file.name.upper()))
    dataset = read.open(tmp_path / named)
    if kind != "analyze":  # Analyze states no place
        assert error(dataset) <= 0.51
    assert dataset.name == ("NIfTI" if kind == "nifti pair" else "Analyze")
    assert any("states no orientation" in note for note in dataset.notes) == (kind != "nifti pair")
    expected = np.sort(scene_on(affine), axis=None)
    np.testing.assert_array_equal(np.sort(whole(dataset), axis=None), expected)


HEADS = {
    ".mhd": "NDims = 3\nDimSize = 4 5 6\nElementType = MET_UCHAR\nElementSpacing = 1 1 1\n"
    "ElementDataFile = {}\n",
    ".nhdr": "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 5 6\nspace: LPS\n"
    "space directions: (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\ndata file: {}\n",
}


@pytest.mark.parametrize("suffix", HEADS)
@pytest.mark.parametrize("named", ["../secret.raw", "{}/secret.raw", "link.raw"])
def test_voxels_elsewhere_are_refused(tmp_path: Path, suffix: str, named: str) -> None:
    (tmp_path / "home").mkdir()
    (tmp_path / "secret.raw").write_bytes(bytes(120))
    (tmp_path / "home" / "link.raw").symlink_to("../secret.raw")
    path = tmp_path / "home" / f"a{suffix}"
    path.write_text(HEADS[suffix].format(named.format(tmp_path)))
    assert "expected a file in" in refusal(path)


@pytest.mark.parametrize("suffix", HEADS)
def test_voxels_beside_the_header_are_read_and_must_be_complete(
    tmp_path: Path, suffix: str
) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_text(HEADS[suffix].format("b c.raw"))
    assert "not found" in refusal(path)
    (tmp_path / "b c.raw").write_bytes(bytes(119))
    assert "found 119 bytes, expected at least 120" in refusal(path)
    (tmp_path / "b c.raw").write_bytes(bytes(range(120)))
    assert np.array_equal(np.sort(whole(read.open(path)), axis=None), np.arange(120))
    path.write_text(HEADS[suffix].format("LIST"))
    assert "a list of files" in refusal(path)
    (tmp_path / "b c.raw").unlink()
    os.mkfifo(tmp_path / "b c.raw")
    path.write_text(HEADS[suffix].format("b c.raw"))
    assert "expected a regular file" in refusal(path)


@pytest.mark.parametrize("suffix", [".mha", ".nrrd"])
@pytest.mark.parametrize("compress", [False, True])
def test_a_file_that_is_cut_short_is_refused_in_one_line(
    tmp_path: Path, suffix: str, compress: bool
) -> None:
    affine = grid()
    path = write(tmp_path / f"a{suffix}", affine, scene_on(affine), compress=compress)
    content = path.read_bytes()
    for size in (0, 20, 200, len(content) // 2, len(content) - 40):
        path.write_bytes(content[:size])
        refusal(path)
    path.unlink()
    path.mkdir()
    assert "found a folder" in refusal(path)


@pytest.mark.slow
def test_a_decompression_bomb_unpacks_no_further_than_the_header_states(tmp_path: Path) -> None:
    head = HEADS[".nhdr"].replace("raw\ndata file: {}", "bzip2\n").encode()
    (tmp_path / "a.nrrd").write_bytes(head + bz2.compress(bytes(1 << 26)))
    assert whole(read.open(tmp_path / "a.nrrd")).shape == (5, 6, 4)


@pytest.mark.parametrize(
    ("suffix", "old", "new", "message"),
    [
        (".mhd", "4 5 6", "4 5", "DimSize: found 4 5, expected three sizes"),
        (".mhd", "4 5 6", "4 5 x", "DimSize: found '4 5 x'"),
        (".mhd", "MET_UCHAR", "MET_STRING", "ElementType: found MET_STRING"),
        (".mhd", "ElementSpacing = 1 1 1\n", "", "ElementSpacing: not found"),
        (".mhd", "1 1 1", "1 nan 1", "ElementSpacing: found '1 nan 1'"),
        (
            ".mhd",
            "NDims",
            "TransformMatrix = 1 0 0 1 0 0 0 0 1\nNDims",
            "don't span three dimensions",
        ),
        (".nhdr", "sizes: 4 5 6", "sizes: 4 5 0", "sizes"),
        (".nhdr", "uint8", "block", "type: found 'block'"),
        (".nhdr", "encoding: raw", "encoding: hex", "encoding: found 'hex'"),
        (".nhdr", "(0,0,1)", "none", "found 2 axes of space"),
        (".nhdr", "(0,0,1)", "(0,1,0)", "don't span three dimensions"),
        (".nhdr", "LPS", "left-right-superior", "expected three axes of the body"),
        (".nhdr", "NRRD0004", "NRRD9999", "expected an NRRD file"),
        (".nhdr", "type: uint8\n", "", "'type' is missing"),
    ],
)
def test_invalid_fields_are_named(
    tmp_path: Path, suffix: str, old: str, new: str, message: str
) -> None:
    (tmp_path / "b.raw").write_bytes(bytes(120))
    text = HEADS[suffix].format("b.raw")
    assert old in text
    (tmp_path / f"a{suffix}").write_text(text.replace(old, new, 1))
    assert message in refusal(tmp_path / f"a{suffix}")
