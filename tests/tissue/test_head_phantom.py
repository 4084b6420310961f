"""The head phantom has its stated properties, in its voxels and in its DICOM series."""

from pathlib import Path

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk
from numpy.typing import NDArray

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.errors import OutputError, UsageError
from stereocell.planning.channels import MR_GREY
from stereocell.samples import write_head
from stereocell.samples.head import (
    BACKGROUND,
    CSF,
    GREY,
    OTHER,
    WHITE,
    WHITE_LEVEL,
    HeadPhantom,
    make_head,
)
from stereocell.samples.head_dicom import IDENTITY, ISOCENTRE_MM, TURN_DEG, affine_of, write_dicom
from stereocell.verify.formats import check
from support.bundles import load
from support.digests import digests_of
from support.identity_search import find

SMALL = (40, 36, 32)


@pytest.fixture(scope="module")
def head() -> HeadPhantom:
    return make_head()


@pytest.fixture(scope="module")
def clean() -> HeadPhantom:
    return make_head(noise=0, bias=0)


@pytest.fixture(scope="module")
def small() -> HeadPhantom:
    return make_head(shape=SMALL, seed=3)


@pytest.fixture(scope="module")
def series(small: HeadPhantom, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("head") / "head"
    write_dicom(folder, small)
    return folder


def middle_mm(mask: NDArray[np.bool_], head: HeadPhantom) -> NDArray[np.float64]:
    """Return the centre of mass from the middle of the grid, in mm: to the front, down, left."""
    spacing = np.array(head.spacing_um) / 1000
    centre = np.array(np.nonzero(mask)).mean(axis=1) - (np.array(mask.shape) - 1) / 2
    return np.asarray(centre * spacing)


# The phantom


def test_the_capsule_is_on_the_left_the_nose_in_front_and_the_neck_below(
    clean: HeadPhantom,
) -> None:
    z, y, x = middle_mm(clean.voxels > 1.1 * WHITE_LEVEL, clean)  # oil, the brightest
    assert (z, y, x) == pytest.approx((12, -18, 76), abs=4)
    head = clean.labels != BACKGROUND
    assert middle_mm(head & (np.arange(len(head)) > len(head) - 6)[:, None, None], clean)[1] > 10
    below, above = head[:, -4:].sum(), head[:, :4].sum()
    assert below > 3 * above
    assert not np.array_equal(clean.labels, clean.labels[:, :, ::-1])


def test_the_right_ventricle_is_the_larger(clean: HeadPhantom) -> None:
    """Inside of the white matter only the ventricles are dark."""
    depth, height, width = clean.labels.shape
    box = np.s_[depth // 4 : 3 * depth // 4, height // 4 : height // 2]
    fluid = clean.labels[box] == CSF
    brain = np.abs(np.arange(width) - (width - 1) / 2) < 30 / 2.1
    right = (fluid & brain & (np.arange(width) < width / 2)).sum()
    left = (fluid & brain & (np.arange(width) >= width / 2)).sum()
    assert right > 1.2 * left > 0


def test_the_shares_of_a_voxel_sum_to_one_and_its_label_has_the_largest(
    head: HeadPhantom,
) -> None:
    np.testing.assert_allclose(head.fractions.sum(axis=0), 1, atol=1e-5)
    assert head.fractions.min() >= -1e-6
    largest = np.take_along_axis(head.fractions, head.labels[None].astype(int), axis=0)[0]
    np.testing.assert_array_equal(largest, head.fractions.max(axis=0))


def test_classes_have_their_signals_bias_and_noise(head: HeadPhantom, clean: HeadPhantom) -> None:
    for label, signal in ((CSF, 0.30), (GREY, 0.62), (WHITE, 1.00)):
        pure = clean.fractions[label] > 0.999
        assert pure.sum() > 1000
        assert (clean.voxels[pure] == round(signal * WHITE_LEVEL)).all()
        values = head.voxels[pure] / head.bias[pure]
        # Rician noise: above 6 sigma the mean is off by sigma^2 / (2 signal).
        shift = 50**2 / (2 * signal * WHITE_LEVEL)
        assert values.mean() == pytest.approx(signal * WHITE_LEVEL + shift, abs=3)
        assert (head.voxels[pure] - values.mean() * head.bias[pure]).std() == pytest.approx(50, 0.1)
    air = clean.fractions[BACKGROUND] > 0.999
    # Rayleigh noise: the mean magnitude without signal
    assert head.voxels[air].mean() == pytest.approx(50 * np.sqrt(np.pi / 2), rel=0.02)
    assert head.bias.min() == pytest.approx(0.9, abs=1e-3)
    assert head.bias.max() == pytest.approx(1.1, abs=1e-3)
    assert OTHER in head.labels


@pytest.mark.slow
def test_a_finer_grid_shows_the_same_head(clean: HeadPhantom) -> None:
    fine = make_head(shape=(140, 120, 120), noise=0, bias=0)
    for label in (CSF, GREY, WHITE):
        ml = [
            h.fractions[label].sum(dtype=np.float64) * np.prod(h.spacing_um) / 1e12
            for h in (clean, fine)
        ]
        assert ml[0] == pytest.approx(ml[1], rel=0.03)


def test_errors_name_the_wrong_argument() -> None:
    for found, message in (
        ({"shape": (4, 96, 96)}, "shape is"),
        ({"noise": -0.1}, "noise is -0.1, expected"),
        ({"bias": 2.0}, "bias is 2"),
        ({"seed": -1}, "seed is -1"),
    ):
        with pytest.raises(UsageError, match=message):
            make_head(**found)  # type: ignore[arg-type]


# The series


def test_the_series_reads_back_as_the_phantom(series: Path, small: HeadPhantom) -> None:
    dataset = read.open(series)
    assert (dataset.name, dataset.modality) == ("MR", "MR")
    assert not [note for note in dataset.notes if "resampled" in note or "interpolated" in note]
    (level,) = dataset.levels
    np.testing.assert_array_equal(dataset.read(0, level.box).voxels, small.voxels)
    assert level.spacing_um == pytest.approx(small.spacing_um, rel=1e-7)
    placement = np.array(dataset.placement)
    assert np.linalg.det(placement[:3, :3]) == pytest.approx(1)
    angle = np.degrees(np.arccos((np.trace(placement[:3, :3]) - 1) / 2))
    assert 5 < angle < 12
    # The middle of the grid lies at the isocentre: world = (L, S, -P).
    z, y, x = ((n - 1) / 2 * h for n, h in zip(SMALL, small.spacing_um, strict=True))
    left, posterior, superior = ISOCENTRE_MM
    found = placement @ [x, -y, z, 1]
    assert found[:3] == pytest.approx(np.array([left, superior, -posterior]) * 1000, abs=0.1)


def test_itk_reads_the_affine_that_was_written(series: Path, small: HeadPhantom) -> None:
    names = sitk.ImageSeriesReader.GetGDCMSeriesFileNames(str(series))
    image = sitk.ReadImage(names)
    depth, height, width = SMALL
    affine = affine_of(small)  # from (slice, row, column)
    index = np.array([(0, 0, 0), (width - 1, height - 1, depth - 1), (3, 5, 7)])
    ours = index @ affine[:3, :3].T + affine[:3, 3]
    for place, (k, row, column) in zip(ours, index.tolist(), strict=True):
        # ITK sorts along the normal, which may run against our slices.
        slices = [k, width - 1 - k]
        theirs = [image.TransformIndexToPhysicalPoint((column, row, int(s))) for s in slices]
        assert min(np.linalg.norm(np.array(t) - place) for t in theirs) < 1e-4
    voxels = sitk.GetArrayFromImage(image)
    stored = small.voxels[::-1].transpose(2, 1, 0)
    assert any(np.array_equal(voxels[:: int(s)], stored) for s in (1, -1))


def test_the_orientation_turns_the_grid_about_all_three_axes(series: Path) -> None:
    first = pydicom.dcmread(next(iter(sorted(series.iterdir()))))
    row, column = np.array(first.ImageOrientationPatient, float).reshape(2, 3)
    assert row @ column == pytest.approx(0, abs=1e-9)
    assert np.abs(np.cross(row, column)) == pytest.approx([1, 0, 0], abs=0.15)
    assert all(abs(part) > 0.01 for part in (row[0], row[2], column[0]))
    assert all(TURN_DEG)


def test_instance_numbers_and_thickness_do_not_show_positions(series: Path) -> None:
    images = [pydicom.dcmread(file) for file in sorted(series.iterdir())]
    assert sorted(ds.InstanceNumber for ds in images) == list(range(1, SMALL[2] + 1))
    images.sort(key=lambda ds: ds.InstanceNumber)
    at = [float(ds.ImagePositionPatient[0]) for ds in images]
    assert at != sorted(at)
    assert at != sorted(at, reverse=True)
    gap = np.diff(sorted(at)).mean()
    assert {float(ds.SliceThickness) for ds in images} == {5.0}
    assert abs(gap - 5.0) > 0.5
    uids = {ds.SOPInstanceUID for ds in images}
    assert len(uids) == len(images)
    assert all(uid.is_valid and uid.startswith("2.25.") for uid in uids)
    assert {ds.file_meta.ImplementationVersionName for ds in images} == {"STEREOCELL"}
    assert all(getattr(ds, name) == value for ds in images for name, value in IDENTITY.items())


def test_the_same_seed_gives_the_same_bytes_and_another_seed_another_series(
    small: HeadPhantom, series: Path, tmp_path: Path
) -> None:
    write_dicom(tmp_path / "head", make_head(shape=SMALL, seed=3))
    assert digests_of(tmp_path / "head") == digests_of(series)
    write_dicom(tmp_path / "other", small, seed=4)
    one, other = (
        {pydicom.dcmread(f, stop_before_pixels=True).SOPInstanceUID for f in folder.iterdir()}
        for folder in (series, tmp_path / "other")
    )
    assert not one & other


@pytest.mark.slow
def test_the_command_keeps_complete_series_and_overwrites_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "head"
    assert main(["sample", "mri", str(folder), "--seed", "2"]) == 0
    before = {file: file.stat().st_mtime_ns for file in folder.iterdir()}
    write_head(folder, seed=2)
    assert {file: file.stat().st_mtime_ns for file in folder.iterdir()} == before
    (folder / "IM0007.dcm").unlink()  # a missing file makes the command write the series again
    write_head(folder, seed=2)
    assert {file.name for file in folder.iterdir()} == {file.name for file in before}
    with pytest.raises(OutputError, match=r"something else.*: choose another place$"):
        write_head(folder, seed=5)
    mine = tmp_path / "mine.txt"
    mine.write_text("mine")
    capsys.readouterr()
    assert main(["sample", "mri", str(mine)]) == 1
    assert "expected nothing or the same sample" in capsys.readouterr().err
    assert mine.read_text("utf-8") == "mine"
    assert main(["sample", "mri", str(tmp_path / "x"), "--seed", "-1"]) == 2
    assert "--seed is -1" in capsys.readouterr().err


@pytest.mark.slow
def test_a_build_is_first_path_traced_and_holds_nothing_about_the_patient(
    series: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    given = ["--preset", "mri", "--workers", "0"]
    assert main(["build", str(series), "-o", str(out), *given]) == 0
    manifest = load(out / "bundle" / "manifest.json")
    assert manifest["specimen"]["modality"] == "MR"
    (channel,) = manifest["channels"]
    assert channel["color"] == list(MR_GREY)
    assert channel["transfer_function"] == "grey"
    assert "threshold" in channel["transfer_functions"]
    assert 0 < channel["threshold_normalized"] < 1
    assert [line for line in check(out) if not line.ok] == []
    image = pydicom.dcmread(series / "IM0001.dcm", stop_before_pixels=True)
    uids = [image[f"{what}InstanceUID"].value for what in ("SOP", "Study", "Series")]
    # Short digits, such as a time of day, occur in any number.
    words = [part for value in IDENTITY.values() for part in value.split("^") if len(part) > 6]
    captured = capfd.readouterr()
    outputs = {"stdout": captured.out, "stderr": captured.err}
    assert find(out, [*words, *uids], outputs) == []
    assert find(series, words)  # the words are in the series, where they can be found
