"""Grouping DICOM frames into stacks, and the notes on a series that is divided."""

from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest
from pydicom.uid import generate_uid

from stereocell import read
from stereocell.model.errors import SourceError
from support.dicom_reading import error
from support.dicom_series import grid, turn, write_enhanced, write_series

SHAPE = (10, 30, 26)
AFFINE = grid(shape=SHAPE, spacing=(2.5, 2.0, 2.2))


def two_stacks(path: Path, shift_mm: float) -> Path:
    """Write an enhanced image of two stacks of 10 slices, 2.5 mm apart, one `shift_mm` higher."""
    ds = pydicom.dcmread(write_enhanced(path, AFFINE, SHAPE))
    lower = list(ds.PerFrameFunctionalGroupsSequence)
    for name, shift in (("1", 0.0), ("2", shift_mm)):
        for group in lower:
            copy = pydicom.Dataset.from_json(group.to_json())
            copy.FrameContentSequence[0].StackID = name
            x, y, z = copy.PlanePositionSequence[0].ImagePositionPatient
            copy.PlanePositionSequence[0].ImagePositionPatient = [x, y, z + shift]
            ds.PerFrameFunctionalGroupsSequence.append(copy)
    ds.PerFrameFunctionalGroupsSequence = list(ds.PerFrameFunctionalGroupsSequence)[10:]
    ds.NumberOfFrames = 20
    ds.PixelData = ds.PixelData * 2
    ds.save_as(path)
    return path


@pytest.mark.parametrize("shift_mm", [50.0, 1.25])
def test_stacks_of_an_enhanced_image_are_separate_series(tmp_path: Path, shift_mm: float) -> None:
    path = two_stacks(tmp_path / "e.dcm", shift_mm)
    lines = read.list_series(path)
    assert len(lines) == 2
    assert all("10 x 30 x 26 voxels (slices, rows, columns), 2.5 x 2 x 2.2 mm" in s for s in lines)
    first, second = (read.open(path, series=number) for number in (1, 2))
    assert first.levels[0].spacing_um == pytest.approx((2000, 2500, 2200))
    rise = np.subtract(second.placement, first.placement)[:3, 3] / 1000
    assert abs(rise[1]) == pytest.approx(shift_mm)
    assert not any("missing" in note for note in first.notes)
    among = [note for note in first.notes if "lie among these" in note]
    assert len(among) == (shift_mm == 1.25)  # the others lie above
    assert all("10 more images" in note and "StackID" in note for note in among)


def alternating(name: str, values: list[Any]) -> Any:
    """Return a function that sets an element to the values in turn, by instance number."""

    def change(ds: pydicom.Dataset) -> None:
        setattr(ds, name, values[int(ds.InstanceNumber) % len(values)])

    return change


def test_slices_with_rounded_pixel_spacings_are_one_series(tmp_path: Path) -> None:
    affine = grid(shape=SHAPE, spacing=(2.5, 0.48825, 0.48825))
    spacings = [["0.48825", "0.488249"], ["0.488249", "0.48825"], ["0.4882", "0.4883"]]
    write_series(tmp_path / "s", affine, SHAPE, change=alternating("PixelSpacing", spacings))
    assert len(read.list_series(tmp_path / "s")) == 1
    dataset = read.open(tmp_path / "s")
    assert (dataset.levels[0].shape, dataset.notes) == ((30, 10, 26), ())
    assert dataset.levels[0].spacing_um == pytest.approx((488.25, 2500, 488.25), rel=1e-4)


def test_slices_with_other_pixel_spacings_are_another_series_with_a_note(tmp_path: Path) -> None:
    spacings = [["2", "2.2"], ["2.01", "2.2"]]
    write_series(tmp_path / "s", AFFINE, SHAPE, change=alternating("PixelSpacing", spacings))
    assert len(read.list_series(tmp_path / "s")) == 2
    notes = read.open(tmp_path / "s").notes
    assert any("5 more images of the same series" in n and "PixelSpacing" in n for n in notes)


def cosines(degrees: float, axis: tuple[int, int, int]) -> list[str]:
    turned = turn(axis, degrees) @ AFFINE[:3, :3]
    row, column = turned[:, 2] / 2.2, turned[:, 1] / 2.0
    return [f"{value:.8f}" for value in (*row, *column)]


@pytest.mark.parametrize("wobble", [8e-4, 9.5e-4])
@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0)])
def test_slices_whose_orientations_wobble_are_one_series_of_the_mean(
    tmp_path: Path, wobble: float, axis: tuple[int, int, int]
) -> None:
    """The orientations alternate about a mean, from which the first one differs by the wobble."""
    degrees = float(np.degrees(wobble))
    turned = alternating(
        "ImageOrientationPatient", [cosines(degrees, axis), cosines(-degrees, axis)]
    )
    write_series(tmp_path / "s", AFFINE, SHAPE, change=turned)
    assert len(read.list_series(tmp_path / "s")) == 1
    dataset = read.open(tmp_path / "s")
    assert not any("missing" in note or "uneven" in note for note in dataset.notes)
    assert np.array(dataset.placement)[:3, :3] == pytest.approx(np.eye(3), abs=1e-6)
    assert error(dataset) <= 0.51


@pytest.mark.slow
@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0), (0, 1, 0)])
def test_planes_that_wobble_about_their_centres_make_no_tilt(
    tmp_path: Path, axis: tuple[int, int, int]
) -> None:
    """The first pixels of 256 x 256 move alternately by a tenth of a millimetre."""
    shape = (10, 256, 256)
    affine = grid(shape=shape, spacing=(3.0, 0.9, 0.9))

    def change(ds: pydicom.Dataset) -> None:
        rotation = turn(axis, float(np.degrees(8e-4)) * (-1) ** int(ds.InstanceNumber))
        row, column = (rotation @ affine[:3, k] / 0.9 for k in (2, 1))
        ds.ImageOrientationPatient = [f"{value:.6f}" for value in (*row, *column)]
        middle = np.array([0, 0, float(ds.ImagePositionPatient[2])])
        corner = middle + rotation @ (np.array(ds.ImagePositionPatient, float) - middle)
        ds.ImagePositionPatient = [f"{value:.4f}" for value in corner]

    write_series(tmp_path / "s", affine, shape, change=change)
    dataset = read.open(tmp_path / "s")
    (note,) = dataset.notes
    assert note.startswith("ImageOrientationPatient changes by up to 0.046 degrees")
    assert error(dataset) <= 0.51 + 0.01 * 1000 / 3.5  # um, by the steepest body's slope


def test_slices_of_different_orientations_stay_separate(tmp_path: Path) -> None:
    turned = alternating(
        "ImageOrientationPatient", [cosines(0, (0, 0, 1)), cosines(0.5, (0, 0, 1))]
    )
    write_series(tmp_path / "s", AFFINE, SHAPE, change=turned)
    assert len(read.list_series(tmp_path / "s")) == 2
    notes = read.open(tmp_path / "s").notes
    assert any("5 more images" in n and "ImageOrientationPatient" in n for n in notes)


def test_localizers_of_one_series_get_no_note_on_interleaving(tmp_path: Path) -> None:
    for plane in ("axial", "coronal"):
        write_series(
            tmp_path / plane,
            grid(plane, shape=SHAPE),
            SHAPE,
            series="1.2.3",
            name=f"{plane}{{}}".format,
        )
    lines = read.list_series(tmp_path)
    assert len(lines) == 2
    assert not any("among" in line for line in lines)


def new_reference(ds: pydicom.Dataset) -> None:
    ds.FrameOfReferenceUID = generate_uid()


@pytest.mark.parametrize("plane", ["axial", "sagittal"])
def test_slices_with_a_frame_of_reference_each_are_joined(tmp_path: Path, plane: str) -> None:
    affine = grid(plane, SHAPE, (2.5, 2.0, 2.2), rotation=turn((1, 2, -0.5), 23.0))
    write_series(tmp_path / "s", affine, SHAPE, change=new_reference)
    dataset = read.open(tmp_path / "s")
    assert error(dataset) <= 0.51
    (note,) = dataset.notes
    assert note.startswith("each of 10 slices has a FrameOfReferenceUID of its own")


def test_joined_slices_keep_their_time_points(tmp_path: Path) -> None:
    for time in range(2):

        def change(ds: pydicom.Dataset, time: int = time) -> None:
            new_reference(ds)
            ds.RescaleIntercept = 7 * time

        folder = tmp_path / "s" / str(time)
        write_series(folder, AFFINE, SHAPE, series="1.2.3", seed=time, change=change)
    assert read.open(tmp_path / "s").time_points == 2


@pytest.mark.parametrize("indices", [[0, 1, 2.3, 3, 4, 5.6], [0, 1]])
def test_slices_with_a_frame_of_reference_each_at_irregular_positions_are_refused(
    tmp_path: Path, indices: list[float]
) -> None:
    write_series(tmp_path / "s", AFFINE, SHAPE, indices=indices, change=new_reference)
    with pytest.raises(SourceError) as caught:
        read.open(tmp_path / "s")
    line = str(caught.value)
    assert "stacks of one slice each, which differ in FrameOfReferenceUID" in line
    assert len(indices) < 3 or "irregular positions (gaps of" in line


def jump_sideways(ds: pydicom.Dataset) -> None:
    """Move the upper half of the slices by 20 mm along the patient's left."""
    x, y, z = ds.ImagePositionPatient
    ds.ImagePositionPatient = [x + (20 if ds.InstanceNumber > 5 else 0), y, z]


def test_slices_with_a_frame_of_reference_each_that_jump_sideways_are_refused(
    tmp_path: Path,
) -> None:
    def change(ds: pydicom.Dataset) -> None:
        new_reference(ds)
        jump_sideways(ds)

    write_series(tmp_path / "s", AFFINE, SHAPE, change=change)
    with pytest.raises(SourceError, match="a sideways jump of 20 mm between neighbouring"):
        read.open(tmp_path / "s")


def test_a_sideways_jump_in_one_series_is_noted_and_makes_no_tilt(tmp_path: Path) -> None:
    write_series(tmp_path / "s", AFFINE, SHAPE, change=jump_sideways)
    notes = read.open(tmp_path / "s").notes
    assert any("jump sideways by up to 20 mm" in note for note in notes)
    assert not any("gantry tilt of" in note for note in notes)


@pytest.mark.parametrize("count", [2, 3])
def test_runs_of_slices_with_a_frame_of_reference_each_are_joined(
    tmp_path: Path, count: int
) -> None:
    def change(ds: pydicom.Dataset) -> None:
        ds.FrameOfReferenceUID = f"1.2.{(ds.InstanceNumber - 1) // count + 1}"

    write_series(tmp_path / "s", AFFINE, SHAPE, change=change)
    dataset = read.open(tmp_path / "s")
    assert error(dataset) <= 0.51
    (note,) = dataset.notes
    assert note.startswith(f"10 slices have {-(-10 // count)} FrameOfReferenceUIDs")


def test_runs_of_slices_with_a_gap_between_them_stay_separate(tmp_path: Path) -> None:
    def change(ds: pydicom.Dataset) -> None:
        ds.FrameOfReferenceUID = f"1.2.{(ds.InstanceNumber - 1) // 3 + 1}"

    indices = [0, 1, 2, 5, 6, 7, 10, 11, 12]
    write_series(tmp_path / "s", AFFINE, SHAPE, indices=indices, change=change)
    assert len(read.list_series(tmp_path / "s")) == 3


def test_slices_of_three_alternating_frames_of_reference_stay_separate(tmp_path: Path) -> None:
    def change(ds: pydicom.Dataset) -> None:
        ds.FrameOfReferenceUID = f"1.2.{ds.InstanceNumber % 3 + 1}"

    write_series(tmp_path / "s", AFFINE, SHAPE, change=change)
    assert len(read.list_series(tmp_path / "s")) == 3


def test_stacks_of_two_frames_of_reference_stay_separate(tmp_path: Path) -> None:
    def change(ds: pydicom.Dataset) -> None:
        ds.FrameOfReferenceUID = f"1.2.{ds.InstanceNumber % 2 + 1}"

    write_series(tmp_path / "s", AFFINE, SHAPE, change=change)
    assert len(read.list_series(tmp_path / "s")) == 2
