"""NIfTI files become volumes in the patient's world."""

import gzip
from contextlib import suppress
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.errors import SourceError
from stereocell.model.tiling import Box
from support.dicom_reading import error, interpolation_bound, lps_mm, whole
from support.dicom_series import grid, sample, tilted, turn
from support.nifti_files import RAS, write

SHAPE = (22, 30, 26)
OBLIQUE = turn((1, 2, -0.5), 23.0)


def scene_on(affine: NDArray[np.float64], dtype: Any = np.int16) -> NDArray[Any]:
    return np.rint(sample(affine, SHAPE)).astype(dtype)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("form", ["sform", "qform"])
@pytest.mark.parametrize("plane", ["axial", "sagittal"])
def test_every_voxel_lies_where_the_scene_has_it(
    tmp_path: Path, suffix: str, form: str, plane: str
) -> None:
    affine = grid(plane, rotation=OBLIQUE, shift=(4, -3, 2))
    dataset = read.open(write(tmp_path / f"Jane_Doe{suffix}", affine, scene_on(affine), form))
    assert error(dataset) < 0.55  # whole numbers; a qform is float32
    assert (dataset.name, dataset.modality, dataset.notes) == ("NIfTI", "", ())
    assert dataset.dtype == np.int16


def test_a_left_handed_grid_is_not_mirrored(tmp_path: Path) -> None:
    affine = grid("coronal", rotation=OBLIQUE)
    affine[:3, 3] += (SHAPE[2] - 1) * affine[:3, 2]
    affine[:3, 2] *= -1
    assert np.linalg.det(affine) * np.linalg.det(grid("coronal")) < 0
    assert error(read.open(write(tmp_path / "a.nii", affine, scene_on(affine)))) <= 0.51


def test_the_sform_takes_precedence_over_the_qform(tmp_path: Path) -> None:
    affine = grid(rotation=OBLIQUE)
    nifti = nibabel.Nifti1Image(scene_on(affine), None)
    nifti.header.set_xyzt_units("mm")
    nifti.header.set_qform(np.diag([3.0, 3, 3, 1]), 1)
    nifti.header.set_sform(RAS @ affine, 2)
    nibabel.save(nifti, tmp_path / "a.nii")
    assert error(read.open(tmp_path / "a.nii")) < 0.55


def test_without_sform_and_qform_the_guess_is_noted(tmp_path: Path) -> None:
    dataset = read.open(write(tmp_path / "a.nii", grid(), scene_on(grid()), form="none"))
    assert any("neither sform nor qform" in note for note in dataset.notes)


@pytest.mark.parametrize(("unit", "um"), [("micron", 1), ("mm", 1000), ("meter", 1e6)])
def test_units_become_um(tmp_path: Path, unit: str, um: float) -> None:
    affine = grid(spacing=(2.5, 2.0, 2.2))
    dataset = read.open(write(tmp_path / "a.nii", affine, scene_on(affine), unit=unit))
    assert sorted(dataset.levels[0].spacing_um) == pytest.approx([2 * um, 2.2 * um, 2.5 * um])


@pytest.mark.parametrize(
    ("stored", "slope", "intercept", "kind"),
    [
        (np.uint8, 2, 5, np.uint16),
        (np.int16, 1, 0, np.int16),
        (np.uint8, 1, 0, np.uint8),
        (np.int16, 0.5, 3, np.float32),
        (np.int32, 1, 0, np.float32),
        (np.float64, 2, 1, np.float32),
    ],
)
def test_slope_and_intercept_apply_and_whole_numbers_stay_whole(
    tmp_path: Path, stored: Any, slope: float, intercept: float, kind: Any
) -> None:
    values = np.arange(60).reshape(3, 4, 5).astype(stored)
    nifti = nibabel.Nifti1Image(values, np.eye(4))
    nifti.header.set_xyzt_units("mm")
    nibabel.save(nifti, tmp_path / "a.nii")
    content = bytearray((tmp_path / "a.nii").read_bytes())
    content[112:120] = np.array([slope, intercept], "<f4").tobytes()  # scl_slope, scl_inter
    (tmp_path / "a.nii").write_bytes(content)
    dataset = read.open(tmp_path / "a.nii")
    assert dataset.dtype == kind
    expected = np.sort((np.arange(60) * slope + intercept).ravel())
    assert np.array_equal(np.sort(whole(dataset).ravel()), expected)


def test_time_points_are_chosen(tmp_path: Path) -> None:
    affine = grid("coronal")
    series = np.stack([scene_on(affine), scene_on(affine) + 5], axis=-1)
    path = write(tmp_path / "a.nii.gz", affine, series)
    first, second = read.open(path), read.open(path, time=1)
    assert (first.time_points, error(first)) == (2, pytest.approx(0.5, abs=0.02))
    assert np.array_equal(whole(second), whole(first) + 5)


def test_skew_axes_are_resampled_onto_an_orthogonal_grid(tmp_path: Path) -> None:
    affine = tilted(grid(rotation=OBLIQUE), SHAPE, 12)
    dataset = read.open(write(tmp_path / "a.nii", affine, scene_on(affine)))
    assert any("skew axes" in note for note in dataset.notes)
    turned = np.array(dataset.placement)[:3, :3]
    assert np.allclose(turned @ turned.T, np.eye(3))
    middle = np.linalg.norm(lps_mm(dataset), axis=-1) < 18  # mm: well inside the skew grid
    from support.dicom_series import scene

    wrong = np.abs(whole(dataset) - scene(lps_mm(dataset)))[middle].max()
    assert wrong < 3 * interpolation_bound(2.5)  # along three axes


def test_nan_is_read_as_the_smallest_finite_value_and_is_noted(tmp_path: Path) -> None:
    """Some programs that cut the brain out of a head write NaN around it, like the rows here."""
    values = sample(grid(), SHAPE).astype(np.float32) + 7
    bare = values.copy()
    bare[:, :5] = np.nan
    dataset = read.open(write(tmp_path / "a.nii.gz", grid(), bare))
    note_text = f"{22 * 5 * 26:,} voxels are NaN or infinite: read as the smallest finite value"
    assert dataset.notes == (note_text,)
    expected = np.nan_to_num(bare, nan=float(np.nanmin(bare)))
    write(tmp_path / "b.nii.gz", grid(), expected)
    voxels = whole(read.open(tmp_path / "b.nii.gz"))
    assert np.array_equal(whole(dataset), voxels)
    box = Box((0, 3, 2), (6, 9, 20))  # only NaN
    part = read.open(tmp_path / "a.nii.gz").read(0, box).voxels
    assert np.array_equal(part, voxels[box.slices])


def test_nan_is_noted_for_the_time_point_that_is_read(tmp_path: Path) -> None:
    values = np.stack([sample(grid(), SHAPE)] * 2, axis=-1).astype(np.float32)
    values[3, 4, 5, 1] = np.nan
    path = write(tmp_path / "a.nii", grid(), values)
    assert not any("NaN" in note for note in read.open(path).notes)
    assert any("1 voxels are NaN" in note for note in read.open(path, time=1).notes)


def test_a_spacing_of_0_is_noted(tmp_path: Path) -> None:
    """nibabel reads it as 1."""
    image = nibabel.Nifti1Image(np.zeros((4, 5, 6), np.uint8), None)
    image.header.set_zooms((2.0, 2.0, 2.0))
    nibabel.save(image, tmp_path / "a.nii")
    assert not any("pixdim" in note for note in read.open(tmp_path / "a.nii").notes)
    patch(tmp_path / "a.nii", 80, np.zeros(1, "<f4"))
    dataset = read.open(tmp_path / "a.nii")
    assert any("pixdim: found 0, read as 1" in note for note in dataset.notes)
    assert sorted(dataset.levels[0].spacing_um) == [1000, 2000, 2000]


def test_infinity_is_read_like_nan(tmp_path: Path) -> None:
    values = sample(grid(), SHAPE).astype(np.float32)
    values[1, 2, 3], values[0, 0, 0], values[4, 4, 4] = np.inf, np.nan, -np.inf
    dataset = read.open(write(tmp_path / "a.nii", grid(), values))
    assert any("3 voxels are NaN or infinite" in note for note in dataset.notes)
    least = values[np.isfinite(values)].min()
    expected = np.where(np.isfinite(values), values, least)
    write(tmp_path / "b.nii", grid(), expected)
    np.testing.assert_array_equal(whole(dataset), whole(read.open(tmp_path / "b.nii")))


def patch(path: Path, start: int, values: NDArray[Any]) -> None:
    """Overwrite values at a place in the header, compressed or not."""
    is_packed = path.suffix == ".gz"
    content = gzip.decompress(path.read_bytes()) if is_packed else path.read_bytes()
    changed = content[:start] + values.tobytes() + content[start + values.nbytes :]
    path.write_bytes(gzip.compress(changed) if is_packed else changed)


def stretched(path: Path) -> None:
    write(path, grid(), scene_on(grid()))
    patch(path, 112, np.array([1e38, 0], "<f4"))  # scl_slope, scl_inter


def empty(path: Path) -> None:
    nibabel.save(nibabel.Nifti1Image(np.full((4, 5, 6), np.nan, np.float32), np.eye(4)), path)


def a_little_too_large(path: Path) -> None:
    """Write a header that claims 1 MiB more than 4 GiB, with little behind it."""
    nifti = nibabel.Nifti1Image(np.zeros((4, 5, 6), np.uint8), np.eye(4))
    nibabel.save(nifti, path)
    patch(path, 42, np.array([1024, 1024, 4097], "<i2"))  # dim


def nothing(path: Path) -> None:
    path.write_bytes(b"")


def cut(path: Path) -> None:
    write(path, grid(), scene_on(grid()))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def colours(path: Path) -> None:
    kind = np.dtype([("R", "u1"), ("G", "u1"), ("B", "u1")])
    nibabel.save(nibabel.Nifti1Image(np.zeros((4, 4, 4), kind), np.eye(4)), path)


def flat(path: Path) -> None:
    nibabel.save(nibabel.Nifti1Image(np.zeros((4, 4), np.uint8), np.eye(4)), path)


def vectors(path: Path) -> None:
    nibabel.save(nibabel.Nifti1Image(np.zeros((4, 4, 4, 1, 3), np.uint8), np.eye(4)), path)


def collapsed(path: Path) -> None:
    nifti = nibabel.Nifti1Image(np.zeros((4, 4, 4), np.uint8), None)
    nifti.header.set_sform(np.diag([1.0, 0, 1, 1]), 1)
    nibabel.save(nifti, path)


def huge(path: Path) -> None:
    write(path, grid(), scene_on(grid()))
    content = bytearray(path.read_bytes())
    content[42:48] = np.array([20000] * 3, "<i2").tobytes()  # dim
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (nothing, "found an empty file"),
        (cut, "cut short|not readable"),
        (colours, "datatype"),
        (flat, "dim: found"),
        (vectors, "dim: found"),
        (collapsed, "three independent axes"),
        (huge, "expected at most 4 GiB|cut short"),
        (a_little_too_large, "found 4.01 GiB, expected at most 4 GiB|cut short"),
        (stretched, "beyond float32"),
        (empty, "found no finite voxel"),
    ],
)
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_a_file_that_is_not_a_volume_is_refused_in_one_line(
    tmp_path: Path, make: Any, words: str, suffix: str
) -> None:
    if suffix == ".nii.gz" and make in (huge,):
        pytest.skip("the header is edited in place")
    path = tmp_path / f"bad{suffix}"
    make(path)
    with pytest.raises(SourceError, match=words) as caught:
        whole(read.open(path))
    assert "\n" not in str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_garbled_files_open_or_raise_a_source_error(tmp_path: Path, suffix: str) -> None:
    """Bytes are changed at random. A file still opens, or is refused in one line."""
    random = np.random.default_rng(0)
    path = write(tmp_path / f"a{suffix}", grid(), scene_on(grid()))
    content = np.frombuffer(path.read_bytes(), np.uint8)
    end = 352 if suffix == ".nii" else len(content)
    for _ in range(150):
        garbled = content.copy()
        places = random.integers(0, end, random.integers(1, 6))
        garbled[places] = random.integers(0, 256, len(places))
        path.write_bytes(garbled.tobytes())
        with suppress(SourceError):
            whole(read.open(path))


@pytest.mark.parametrize("expected", ["intent", "table"])
def test_labels_that_the_header_states_end_the_plan(
    tmp_path: Path, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """A mask of one object, which the voxels alone would not reveal as labels."""
    voxels = np.zeros(SHAPE, np.uint8)
    voxels[5:12, 5:12, 5:12] = 1
    nifti = nibabel.Nifti1Image(voxels, np.diag([2.0, 2.0, 2.0, 1.0]))
    nifti.header.set_xyzt_units("mm")
    if expected == "intent":
        nifti.header.set_intent("label")
    else:
        text = b"<CaretExtension><LabelTable><Label Key='1'>JANE DOE</Label></LabelTable>"
        nifti.header.extensions.append(nibabel.nifti1.Nifti1Extension("comment", text))
    nibabel.save(nifti, tmp_path / "m.nii.gz")
    source, out = str(tmp_path / "m.nii.gz"), str(tmp_path / "out")
    assert main(["plan", source, "-o", out]) == 2
    printed = capsys.readouterr().err
    assert ("intent code 1002" if expected == "intent" else "a table of labels") in printed
    assert "JANE" not in printed
    assert main(["plan", source, "-o", out, "--as", "intensity"]) == 0


def test_values_on_a_surface_are_named_in_the_refusal(tmp_path: Path) -> None:
    axes = (
        nibabel.cifti2.ScalarAxis(["a"]),
        nibabel.cifti2.BrainModelAxis.from_surface(np.arange(5), 9, name="CortexLeft"),
    )
    image = nibabel.cifti2.Cifti2Image(np.ones((1, 5), np.float32), axes)
    nibabel.save(image, tmp_path / "s.dscalar.nii")
    with pytest.raises(SourceError, match=r"found CIFTI \(values on surfaces"):
        read.open(tmp_path / "s.dscalar.nii")
    gifti = nibabel.gifti.GiftiImage()
    nibabel.save(gifti, tmp_path / "LEFT.SURF.gii")
    with pytest.raises(SourceError, match="a surface"):
        read.open(tmp_path / "LEFT.SURF.gii")


def test_several_values_at_each_voxel_are_refused_in_the_terms_of_the_field(tmp_path: Path) -> None:
    affine = np.diag([2.0, 2, 2, 1])
    colors = np.zeros((4, 5, 6), [("R", "u1"), ("G", "u1"), ("B", "u1")])
    nibabel.save(nibabel.Nifti1Image(colors, affine), tmp_path / "a.nii")
    with pytest.raises(SourceError, match="datatype: found colours, expected whole or real"):
        read.open(tmp_path / "a.nii")
    vectors = np.zeros((4, 5, 6, 1, 3), np.float32)
    nibabel.save(nibabel.Nifti1Image(vectors, affine), tmp_path / "b.nii")
    with pytest.raises(SourceError, match="3 values at each voxel: save only one of them"):
        read.open(tmp_path / "b.nii")
