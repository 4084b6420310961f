"""DICOM folders and files become volumes in the patient's world, whatever their geometry."""

from pathlib import Path

import numpy as np
import pydicom
import pytest
from numpy.typing import NDArray
from pydicom import uid

from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from support.dicom_reading import error, interpolation_bound, lps_mm, whole
from support.dicom_series import (
    compress,
    grid,
    image,
    sample,
    save,
    scene,
    tilted,
    turn,
    write_enhanced,
    write_f_dicom,
    write_f_nifti,
    write_series,
)
from support.phantoms import f_phantom

SHAPE = (22, 30, 26)
OBLIQUE = turn((1, 2, -0.5), 23.0)


@pytest.mark.parametrize("plane", ["axial", "coronal", "sagittal"])
@pytest.mark.parametrize("rotation", [None, OBLIQUE, turn((0, 1, 1), 97.0)])
def test_every_voxel_lies_at_its_position_in_the_scene(
    tmp_path: Path, plane: str, rotation: NDArray[np.float64] | None
) -> None:
    write_series(tmp_path / "s", grid(plane, rotation=rotation, shift=(3, -5, 8)))
    dataset = read.open(tmp_path / "s")
    assert error(dataset) <= 0.51  # rounded to integers
    assert (dataset.name, dataset.modality, dataset.channels[0].name) == ("MR", "MR", "MR")
    assert dataset.dtype == np.int16
    assert dataset.notes == ()
    turned = np.array(dataset.placement)[:3, :3]
    assert np.linalg.det(turned) == pytest.approx(1)
    assert (np.diag(turned) > 0.5).all()  # near the identity: flips and permutations align the axes


@pytest.mark.slow
def test_the_letter_f_is_the_same_from_dicom_and_nifti(tmp_path: Path) -> None:
    """Its axes are canonical, so that the placement is only an offset."""
    write_f_dicom(tmp_path / "dicom", f_phantom(), (0.5, 0.2, 0.3))
    write_f_nifti(tmp_path / "f.nii", f_phantom(), (0.5, 0.2, 0.3))
    for source in ("dicom", "f.nii"):
        dataset = read.open(tmp_path / source)
        assert np.array_equal(whole(dataset), f_phantom())
        assert np.allclose(dataset.placement, np.eye(4), atol=1e-5)
        assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.3))


def test_rows_run_down_columns_to_the_left_of_the_patient_slices_to_the_front(
    tmp_path: Path,
) -> None:
    """For planes that are not turned the placement is only an offset."""
    write_series(tmp_path / "s", grid("sagittal"))
    dataset = read.open(tmp_path / "s")
    assert np.array_equal(np.array(dataset.placement)[:3, :3], np.eye(3))
    z, y, x = (lps_mm(dataset)[i] - lps_mm(dataset)[0, 0, 0] for i in
               ((1, 0, 0), (0, 1, 0), (0, 0, 1)))  # fmt: skip
    assert (z[1], y[2], x[0]) == pytest.approx((-2.2, -2.0, 2.5))  # anterior, inferior, left


def test_missing_slices_are_interpolated_and_the_gap_is_noted(tmp_path: Path) -> None:
    kept = [k for k in range(22) if k not in (7, 8, 15)]
    write_series(tmp_path / "s", grid(spacing=(1.5, 2, 2.2)), indices=kept)
    dataset = read.open(tmp_path / "s")
    (note,) = dataset.notes
    assert "3 missing slices" in note
    assert "gaps of 4.5, 3 mm among slices 1.5 mm apart" in note
    assert dataset.levels[0].spacing_um[1] == pytest.approx(1500)
    assert dataset.levels[0].shape == (30, 22, 26)
    assert error(dataset) <= interpolation_bound(4.5)
    full = np.moveaxis(whole(dataset), 1, 0)[::-1, ::-1]
    own = np.rint(sample(grid(spacing=(1.5, 2, 2.2)), SHAPE))
    assert np.array_equal(full[kept], own[kept])
    between = (2 * own[6] + own[9]) / 3
    assert np.abs(full[7] - between).max() <= 0.51


def test_uneven_distances_become_even_ones_of_their_median(tmp_path: Path) -> None:
    steps = np.array([1.0, 1.4, 1.0, 0.8, 1.0, 1.3] * 4)
    write_series(tmp_path / "s", grid(spacing=(1.5, 2, 2.2)), indices=np.cumsum(steps).tolist())
    dataset = read.open(tmp_path / "s")
    (note,) = dataset.notes
    assert "uneven gaps of 1.2 to 2.1 mm" in note
    assert dataset.levels[0].spacing_um[1] == pytest.approx(1500, rel=0.03)
    assert error(dataset) <= interpolation_bound(2.1)


def test_rounding_of_positions_does_not_accumulate(tmp_path: Path) -> None:
    def rounded(ds: pydicom.Dataset) -> None:
        x, y, z = ds.ImagePositionPatient
        ds.ImagePositionPatient = [x, y, round(float(z), 2)]

    write_series(tmp_path / "s", grid(spacing=(2 / 3, 2, 2.2)), change=rounded)
    dataset = read.open(tmp_path / "s")
    assert dataset.notes == ()
    assert dataset.levels[0].spacing_um[1] == pytest.approx(2000 / 3, rel=1e-3)


@pytest.mark.parametrize("degrees", [15.0, -22.5])
def test_tilted_gantry_is_resampled_onto_an_orthogonal_grid(tmp_path: Path, degrees: float) -> None:
    affine = tilted(grid(rotation=turn((1, 0, 0), 4)), SHAPE, degrees)
    write_series(tmp_path / "s", affine)
    dataset = read.open(tmp_path / "s")
    (note,) = dataset.notes
    assert f"gantry tilt of {abs(degrees):.3g} degrees" in note
    inside = whole(dataset) > 0
    difference = np.abs(whole(dataset) - scene(lps_mm(dataset)))[inside]
    assert difference.max() <= interpolation_bound(2.0)
    # voxels that no slice reaches are empty, and the scene has an edge there
    assert error(dataset) < 200
    assert dataset.levels[0].shape[0] > 30  # grown by the drift


def test_copies_are_dropped_without_a_note_on_pixels(tmp_path: Path) -> None:
    paths = write_series(tmp_path / "s", grid())
    (tmp_path / "s" / "again").mkdir()
    for path in paths[:3]:
        (tmp_path / "s" / "again" / path.name).write_bytes(path.read_bytes())
    dataset = read.open(tmp_path / "s")
    assert dataset.notes == ("files left out: 3 copies of others",)
    assert error(dataset) <= 0.51


@pytest.mark.parametrize("brighter", [0, 5])
def test_the_duplicate_with_the_lowest_instance_number_is_read_with_a_note(
    tmp_path: Path, brighter: int
) -> None:
    paths = write_series(tmp_path / "s", grid())
    ds = pydicom.dcmread(paths[4])
    ds.SOPInstanceUID = ds.file_meta.MediaStorageSOPInstanceUID = uid.generate_uid()
    ds.InstanceNumber = 1000
    ds.PixelData = (ds.pixel_array + brighter).tobytes()
    save(ds, tmp_path / "s" / "0")
    dataset = read.open(tmp_path / "s")
    (note,) = dataset.notes
    assert "1 duplicate slice" in note
    assert ("with other pixels" in note) == bool(brighter)
    assert error(dataset) <= 0.51


@pytest.mark.slow
def test_equally_many_images_at_every_position_are_time_points(tmp_path: Path) -> None:
    def later(ds: pydicom.Dataset) -> None:
        ds.InstanceNumber += 100
        ds.RescaleIntercept = 7

    write_series(tmp_path / "s" / "a", grid(), series="1.2.5")
    write_series(tmp_path / "s" / "b", grid(), series="1.2.5", change=later)
    assert error(read.open(tmp_path / "s")) <= 0.51
    second = read.open(tmp_path / "s", time=1)
    assert second.time_points == 2
    assert np.array_equal(whole(second), whole(read.open(tmp_path / "s")) + 7)


@pytest.mark.slow
def test_the_largest_series_is_read_and_any_can_be_chosen(tmp_path: Path) -> None:
    write_series(tmp_path / "s" / "deep" / "er", grid("coronal"), name="{}".format)
    small = grid("axial", (6, 10, 12))
    write_series(
        tmp_path / "s" / "a.dir",
        small,
        (6, 10, 12),
        modality="CT",
        bits=12,
        dtype=np.uint16,
        intercept=-1024,
    )
    for index, plane in enumerate(("axial", "sagittal", "coronal")):  # a localizer
        ds = image(np.zeros((40, 40), np.int16), grid(plane, (1, 40, 40)), 0, series="1.2.6")
        save(ds, tmp_path / "s" / "loc" / f"{index}")
    (tmp_path / "s" / "readme.txt").write_text("no image")
    lines = read.list_series(tmp_path / "s")
    assert len(lines) == 5
    assert "MR, coronal, 22 x 30 x 26 voxels (slices, rows, columns), 2.5 x 2 x 2.2 mm" in lines[0]
    assert "CT, axial, 6 x 10 x 12" in lines[1]
    assert all("a volume needs at least 2 slices: found 1" in line for line in lines[2:])
    dataset = read.open(tmp_path / "s")
    assert dataset.modality == "MR"
    assert (
        "5 series or orientations; building --series 1, the largest: MR, coronal"
        in (dataset.notes[0])
    )
    assert dataset.notes[1].startswith("not built: --series 2: CT, axial, 6 x 10 x 12 voxels")
    assert all(f"; --series {n}: " in dataset.notes[1] for n in (3, 4, 5))
    assert dataset.notes[2] == "file left out: 1 not DICOM"
    second = read.open(tmp_path / "s", series=2)
    assert (second.modality, second.dtype) == ("CT", np.int16)
    assert np.abs(whole(second) + 1024 - scene(lps_mm(second))).max() <= 0.51
    with pytest.raises(SourceError, match="at least 2 slices"):
        read.open(tmp_path / "s", series=4)
    with pytest.raises(UsageError, match="--series: found 6, expected 1 to 5"):
        read.open(tmp_path / "s", series=6)


@pytest.mark.parametrize("modality", ["MR", "CT"])
def test_enhanced_frames_have_their_own_position_and_rescale(tmp_path: Path, modality: str) -> None:
    path = write_enhanced(tmp_path / "frames", grid("sagittal", rotation=OBLIQUE), SHAPE, modality)
    dataset = read.open(path)
    assert error(dataset) <= 1.01  # slopes of up to 2
    assert dataset.modality == modality
    slope, intercept = dataset.notes[:2]
    assert slope == "RescaleSlope differs between images (1 to 2): each image has its own"
    assert intercept.startswith("RescaleIntercept differs between images (-20 to 0)")


def as_patients_come(ds: pydicom.Dataset) -> None:
    """Set the attributes that highdicom requires in a single frame before it converts it."""
    for name in ("PatientBirthDate", "PatientSex", "AccessionNumber", "ReferringPhysicianName",
                 "StudyID", "PositionReferenceIndicator", "Laterality"):  # fmt: skip
        setattr(ds, name, "")
    ds.PatientID, ds.PatientName, ds.Manufacturer = "x", "x^y", "x"
    ds.PatientPosition, ds.ImageType = "HFS", ["ORIGINAL", "PRIMARY", "M"]
    ds.SeriesNumber = ds.AcquisitionNumber = 1
    for name in ("Study", "Content", "Acquisition"):
        setattr(ds, f"{name}Date", "20200101")
        setattr(ds, f"{name}Time", "000000")


@pytest.mark.slow
@pytest.mark.parametrize("modality", ["MR", "CT"])
def test_enhanced_images_that_highdicom_converts_lie_at_the_slices_positions(
    tmp_path: Path, modality: str
) -> None:
    from highdicom import legacy  # the import takes 1 s

    kinds = {
        "MR": legacy.LegacyConvertedEnhancedMRImage,
        "CT": legacy.LegacyConvertedEnhancedCTImage,
    }
    affine = grid("coronal", rotation=OBLIQUE)
    files = write_series(tmp_path / "s", affine, modality=modality, change=as_patients_come)
    frames = [pydicom.dcmread(file) for file in files]
    kinds[modality](frames, uid.generate_uid(), 2, uid.generate_uid(), 1).save_as(tmp_path / "e")
    assert error(read.open(tmp_path / "e")) <= 0.51


SYNTAXES = {
    "RLE": (uid.RLELossless, np.int16, 0.0),
    "JPEG-LS": (uid.JPEGLSLossless, np.uint16, 0.0),
    "J2K": (uid.JPEG2000Lossless, np.int16, 0.0),
    "JPEG lossless": (uid.JPEGLosslessSV1, np.uint16, 0.0),
    "JPEG": (uid.JPEGBaseline8Bit, np.uint8, 6.0),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SYNTAXES)
def test_compressed_pixels_equal_the_original_ones(tmp_path: Path, name: str) -> None:
    syntax, dtype, tolerance = SYNTAXES[name]
    shape, affine = (4, 40, 36), grid(shape=(4, 40, 36))  # JPEG 2000 doesn't accept planes below 32
    height = 250 / 1000 if dtype == np.uint8 else 1
    paths = []
    for k, plane in enumerate(sample(affine, shape)):
        ds = image(np.rint(plane * height).astype(dtype), affine, k, number=k, series="1.2.9")
        paths.append(save(ds, tmp_path / "s" / f"{k}"))
    plain = read.open(tmp_path / "s")
    before = whole(plain)
    for path in paths:
        compress(path, syntax)
    dataset = read.open(tmp_path / "s")
    assert pydicom.dcmread(paths[0]).file_meta.TransferSyntaxUID == syntax
    assert dataset.dtype == plain.dtype == np.dtype(dtype)
    assert np.abs(whole(dataset).astype(int) - before).max() <= tolerance


@pytest.mark.parametrize("bits", [7, 12])
def test_signed_values_of_fewer_bits_in_jpeg_ls_keep_their_signs(tmp_path: Path, bits: int) -> None:
    shape, dtype = (3, 12, 10), np.int8 if bits <= 8 else np.int16
    values = np.linspace(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1, 360).astype(dtype).reshape(shape)
    for k, plane in enumerate(values):
        ds = image(plane, grid(shape=shape), k, bits=bits)
        compress(save(ds, tmp_path / "s" / f"{k}"), uid.JPEGLSLossless)
    dataset = read.open(tmp_path / "s")
    assert np.array_equal(np.sort(whole(dataset).ravel()), values.ravel())


def test_signed_values_of_12_bits_are_read_below_an_overlay(tmp_path: Path) -> None:
    values = np.arange(-2048, -2048 + 12 * 10 * 3).reshape(3, 12, 10)
    for k, plane in enumerate(values):
        stored = (plane & 0x0FFF) | 0xA000  # bits 13 and 15 belong to an overlay
        ds = image(stored.astype(np.uint16).view(np.int16), grid(), k, bits=12)
        save(ds, tmp_path / "s" / f"{k}")
    dataset = read.open(tmp_path / "s")
    assert dataset.dtype == np.int16
    assert np.array_equal(np.sort(whole(dataset).ravel()), values.ravel())


@pytest.mark.slow
def test_monochrome1_is_inverted_within_its_bits(tmp_path: Path) -> None:
    write_series(tmp_path / "a", grid(), dtype=np.uint16, bits=12)
    write_series(tmp_path / "b", grid(), dtype=np.uint16, bits=12, photometric="MONOCHROME1")
    plain, inverted = (read.open(tmp_path / name) for name in "ab")
    assert np.array_equal(whole(inverted), 4095 - whole(plain))


def test_separate_slopes_for_each_slice_give_real_numbers(tmp_path: Path) -> None:
    for k in range(6):
        pixels = np.full((8, 9), 100, np.uint16)
        save(image(pixels, grid(), k, slope=0.5 + k, intercept=k), tmp_path / "s" / f"{k}")
    dataset = read.open(tmp_path / "s")
    assert dataset.dtype == np.float32
    assert np.array_equal(whole(dataset)[0, ::-1, 0], [100 * (0.5 + k) + k for k in range(6)])


def test_pixels_are_not_read_before_they_are_requested(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_series(tmp_path / "s", grid())
    calls = []
    monkeypatch.setattr(
        "stereocell.read.formats.dicom.image.decode",
        lambda *a: calls.append(1) or np.zeros(SHAPE, np.int16),
    )
    dataset = read.open(tmp_path / "s")
    assert calls == []
    whole(dataset)
    whole(dataset)
    assert calls == [1]  # once in each process


@pytest.mark.slow
def test_fingerprint_depends_on_geometry_modality_and_pixels(tmp_path: Path) -> None:
    first = read.open(write_series(tmp_path / "a", grid())[0].parent).fingerprint

    def renamed(ds: pydicom.Dataset) -> None:
        ds.PatientName, ds.StudyDate = "Doe^Jane", "20200101"

    write_series(tmp_path / "b", grid(), change=renamed, name="other{}".format, seed=3)
    assert read.open(tmp_path / "b").fingerprint == first
    write_series(tmp_path / "c", grid(rotation=turn((0, 0, 1), 1)))
    assert read.open(tmp_path / "c").fingerprint != first
    write_series(tmp_path / "d", grid(), modality="CT")
    assert read.open(tmp_path / "d").fingerprint != first
