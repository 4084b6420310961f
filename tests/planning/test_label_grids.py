"""The place of label maps on an image if the two files state different grids."""

from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest
import SimpleITK
import tifffile
import zarr

from stereocell import read
from stereocell.model.errors import SourceError
from stereocell.planning.label_maps import FoundLabels, find_labels
from stereocell.planning.settings import PlanOptions, Settings

SHAPE = (6, 20, 28)
NUMBERS = np.arange(np.prod(SHAPE)).reshape(SHAPE).astype(np.uint16)


def write_tiff(path: Path, voxels: Any, *, axes: str = "ZYX", **stated: Any) -> Path:
    metadata = {"axes": axes, **stated}
    tifffile.imwrite(path, voxels, imagej=True, metadata=metadata, resolution=(4, 4))
    return path


def calibrated(path: Path, voxels: Any, *, axes: str = "ZYX") -> Path:
    return write_tiff(path, voxels, axes=axes, unit="um", spacing=0.6)


def write_ngff(
    path: Path, levels: list[Any], scales: list[list[float]], place: list[float]
) -> Path:
    """Write an OME-Zarr image whose levels are translated by `place`, um."""
    group = zarr.open_group(path, mode="w", zarr_format=2)
    for number, voxels in enumerate(levels):
        group.create_array(str(number), shape=voxels.shape, dtype=voxels.dtype)[...] = voxels
    datasets = [
        {
            "path": str(number),
            "coordinateTransformations": [
                {"type": "scale", "scale": scale},
                {"type": "translation", "translation": place},
            ],
        }
        for number, scale in enumerate(scales)
    ]
    axes = [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]
    group.attrs["multiscales"] = [{"version": "0.4", "axes": axes, "datasets": datasets}]
    return path


def lay(image: Path, labels: Path, time: int = 0) -> FoundLabels:
    settings = Settings(plan=PlanOptions(time=time))
    return find_labels(
        read.open(image, time=time),
        str(image),
        {"cells": str(labels)},
        settings=settings,
        colors=[(1, 1, 1)],
        taken=[],
    )


@pytest.fixture
def image(tmp_path: Path) -> Path:
    return calibrated(tmp_path / "image.tif", NUMBERS)


def test_labels_on_the_image_s_own_grid_cause_no_note(image: Path, tmp_path: Path) -> None:
    found = lay(image, calibrated(tmp_path / "l.tif", NUMBERS))
    assert found.notes == ()
    assert found.labels[0].origin_um == (0, 0, 0)


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (np.s_[:, :, :20], "cover 20 of 28 columns (x), 0 to 19, of the image; their file states"),
        (np.s_[1:, :19, :], "cover 5 of 6 planes (z), 0 to 4, and 19 of 20 rows (y), 0 to 18,"),
    ],
)
def test_a_note_says_that_labels_of_a_crop_cover_a_part_of_the_image(
    image: Path, tmp_path: Path, part: Any, message: str
) -> None:
    (note,) = lay(image, calibrated(tmp_path / "l.tif", NUMBERS[part])).notes
    assert note.startswith(f"labels 'cells': {message}")
    assert "they start at the image's first voxel" in note


def test_a_note_says_that_labels_reach_beyond_the_image(image: Path, tmp_path: Path) -> None:
    larger = np.pad(NUMBERS, ((0, 0), (0, 1), (0, 2)))
    (note,) = lay(image, calibrated(tmp_path / "l.tif", larger)).notes
    assert "reach 0.25 um beyond the last row (y) and 0.5 um beyond the last column (x)" in note


def test_labels_of_a_crop_lie_at_the_place_that_their_file_states(tmp_path: Path) -> None:
    whole = write_ngff(tmp_path / "i.zarr", [NUMBERS], [[0.6, 0.25, 0.25]], [0, 0, 5.0])
    crop = write_ngff(
        tmp_path / "l.zarr", [NUMBERS[:, :, 8:]], [[0.6, 0.25, 0.25]], [0.0, 0.0, 7.0]
    )
    found = lay(whole, crop)
    assert found.labels[0].origin_um == pytest.approx((0, 0, 2.0))
    (note,) = found.notes
    assert note == "labels 'cells': cover 20 of 28 columns (x), 8 to 27, of the image"


@pytest.mark.parametrize("factor", [2, 3, 4])
def test_labels_at_half_the_resolution_may_be_a_little_longer(
    image: Path, tmp_path: Path, factor: int
) -> None:
    for rounded in (NUMBERS[:, ::factor, ::factor], NUMBERS[:, factor - 1 :: factor, ::factor]):
        spacing = [0.6, 0.25 * factor, 0.25 * factor]
        shift = [0, 0.125 * (factor - 1), 0.125 * (factor - 1)]
        coarse = write_ngff(tmp_path / "l.zarr", [rounded], [spacing], shift)
        assert lay(image, coarse).notes == ()


def test_labels_with_as_many_voxels_take_the_image_s_voxel_size(tmp_path: Path) -> None:
    whole = write_ngff(tmp_path / "i.zarr", [NUMBERS], [[0.6, 0.25, 0.25]], [0, 0, 0])
    labels = write_ngff(tmp_path / "l.zarr", [NUMBERS], [[1.0, 1.0, 1.0]], [0, 0, 0])
    found = lay(whole, labels)
    assert found.labels[0].spacing_um == (0.6, 0.25, 0.25)
    (note,) = found.notes
    assert "the image, which has as many voxels, states 0.6, 0.25, 0.25 um" in note
    assert "the labels' file states 1, 1, 1 um" in note


def test_a_rounded_spacing_is_not_a_contradiction(tmp_path: Path) -> None:
    whole = write_ngff(tmp_path / "i.zarr", [NUMBERS], [[0.6, 0.25, 0.25]], [0, 0, 0])
    rounded = write_ngff(tmp_path / "l.zarr", [NUMBERS], [[0.6, 0.2501, 0.2501]], [0, 0, 0])
    assert lay(whole, rounded).notes == ()


def test_labels_without_a_size_lie_on_the_level_of_their_shape(tmp_path: Path) -> None:
    scales = [[0.6, 0.25, 0.25], [0.6, 0.5, 0.5]]
    levels = [NUMBERS, NUMBERS[:, ::2, ::2]]
    whole = write_ngff(tmp_path / "i.zarr", levels, scales, [0, 0, 0])
    for number, voxels in enumerate(levels):
        tifffile.imwrite(tmp_path / "l.tif", voxels, metadata={"axes": "ZYX"})
        found = lay(whole, tmp_path / "l.tif")
        assert found.labels[0].spacing_um == tuple(scales[number])
        assert (
            f"is assumed, as resolution level {number} of the image has as many" in found.notes[0]
        )
    tifffile.imwrite(tmp_path / "l.tif", NUMBERS.transpose(2, 1, 0), metadata={"axes": "ZYX"})
    with pytest.raises(SourceError, match="its axes are in another order; save it as"):
        lay(whole, tmp_path / "l.tif")


def test_labels_follow_the_image_s_point_in_time(tmp_path: Path) -> None:
    films = np.stack([NUMBERS, NUMBERS[::-1]])
    film = calibrated(tmp_path / "film.tif", films, axes="TZYX")
    still = calibrated(tmp_path / "still.tif", NUMBERS)
    moving = calibrated(tmp_path / "moving.tif", films, axes="TZYX")
    found = lay(film, moving, 1)
    source = found.labels[0].open()
    np.testing.assert_array_equal(source.read(source.dataset.levels[0].box), NUMBERS[::-1])
    assert found.notes == ("labels 'cells': 2 time points; building --time 1",)
    assert "has one point in time, which is used for --time 1 of 2" in lay(film, still, 1).notes[0]
    assert "2 time points; building --time 0" in lay(still, moving).notes[0]
    longer = calibrated(tmp_path / "longer.tif", np.stack([NUMBERS] * 3), axes="TZYX")
    with pytest.raises(SourceError, match="found 2 points in time, expected the image's --time 2"):
        lay(longer, moving, 2)


def test_a_note_names_the_channels_of_a_label_map(image: Path, tmp_path: Path) -> None:
    pair = calibrated(tmp_path / "l.tif", np.stack([NUMBERS] * 2, axis=1), axes="ZCYX")
    found = lay(image, pair)
    assert len(found.labels) == 2
    assert "2 channels, each a label map: Channel0, Channel1" in found.notes[0]


def test_a_note_says_which_part_a_crop_of_a_patient_s_labels_covers(tmp_path: Path) -> None:
    """One library writes the image as NRRD, another the labels as NIfTI."""
    voxels = SimpleITK.GetImageFromArray(NUMBERS)
    voxels.SetSpacing((1.0, 1.0, 2.5))
    voxels.SetOrigin((-10.0, 5.0, 30.0))
    SimpleITK.WriteImage(voxels, str(tmp_path / "i.nrrd"))
    affine = np.diag([-1.0, -1.0, 2.5, 1.0])
    affine[:3, 3] = [10.0 - 8, -5.0, 30.0 + 2.5]
    crop = NUMBERS[1:, :, 8:].astype(np.uint8).transpose(2, 1, 0)
    nibabel.save(nibabel.Nifti1Image(crop, affine), tmp_path / "l.nii")
    *_, note = lay(tmp_path / "i.nrrd", tmp_path / "l.nii").notes
    assert "cover 5 of 6 voxels along y, 0 to 4, and 20 of 28 voxels along x, 8 to 27," in note
    assert "states no place" not in note
