"""Mosaics of slices become volumes that agree with the scene and with nibabel's own reader."""

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest
from numpy.typing import NDArray
from pydicom.uid import JPEGLSLossless, generate_uid

from stereocell import read
from stereocell.model.errors import SourceError
from support.dicom_mosaics import SHAPE, SPACING, csa, write_mosaic
from support.dicom_reading import error, lps_mm, whole
from support.dicom_series import compress, grid, turn


def affine_of(turned: bool, downwards: bool) -> NDArray[np.float64]:
    rotation = turn((1, 2, -0.5), 23.0) if turned else None
    affine = grid(shape=SHAPE, spacing=SPACING, rotation=rotation, shift=(4, -3, 2))
    if downwards:  # from the last slice to the first
        affine[:3, 3] += affine[:3, 0] * (SHAPE[0] - 1)
        affine[:3, 0] *= -1
    return affine


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("downwards", [False, True])
def test_every_voxel_lies_at_its_position_in_the_scene(
    tmp_path: Path, turned: bool, downwards: bool
) -> None:
    path = write_mosaic(tmp_path / "m.dcm", affine_of(turned, downwards))
    dataset = read.open(path)
    assert sorted(dataset.levels[0].shape) == sorted(SHAPE)
    assert error(dataset) < 0.51  # rounded to integers
    assert dataset.notes == ("mosaics of 7 slices in one image: separated into slices",)


def test_nibabel_reads_the_same_voxels_at_the_same_positions(tmp_path: Path) -> None:
    path = write_mosaic(tmp_path / "m.dcm", affine_of(True, True))
    dataset = read.open(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from nibabel.nicom import dicomwrappers

        theirs = dicomwrappers.wrapper_from_file(path)
        affine, voxels = theirs.affine, theirs.get_data()
    step = np.linalg.inv(affine)
    index = lps_mm(dataset) @ step[:3, :3].T + step[:3, 3]
    assert np.abs(index - np.rint(index)).max() < 1e-3
    i, j, k = np.moveaxis(np.rint(index).astype(int), -1, 0)
    assert np.array_equal(voxels[i, j, k], whole(dataset))


@pytest.mark.parametrize("is_compressed", [False, True])
def test_mosaics_of_a_series_are_time_points(tmp_path: Path, is_compressed: bool) -> None:
    affine = affine_of(True, False)
    series = generate_uid()
    for number, name in ((2, "a"), (3, "b"), (1, "c")):
        path = write_mosaic(tmp_path / "s" / name, affine, number, series)
        if is_compressed:
            compress(path, JPEGLSLossless)
    first = whole(read.open(tmp_path / "s"))
    assert read.open(tmp_path / "s").time_points == 3
    for time in (1, 2):
        later = whole(read.open(tmp_path / "s", time=time))
        assert np.array_equal(later, first * (time + 1))


def test_a_grid_of_slices_with_separate_positions_is_read(tmp_path: Path) -> None:
    """UIH's VFRAME: 7 slices in 3 columns and 3 rows, each with its position."""
    affine = affine_of(True, False)

    def change(ds: Any) -> None:
        ds.ImageType = ["ORIGINAL", "PRIMARY", "M", "VFRAME"]
        del ds.ImagePositionPatient
        del ds[0x00290010], ds[0x00291010]
        block = ds.private_block(0x0065, "Image Private Header", create=True)
        items = []
        for k in range(SHAPE[0]):
            item = pydicom.Dataset()
            place = affine[:3, 3] + k * affine[:3, 0]
            item.ImagePositionPatient = [f"{value:.9g}" for value in place]
            items.append(item)
        block.add_new(0x51, "SQ", items)

    dataset = read.open(write_mosaic(tmp_path / "m.dcm", affine, change=change))
    assert error(dataset) < 0.51


def _without_header(ds: Any) -> None:
    del ds[0x00291010]


def _of_another_size(ds: Any) -> None:
    ds[0x00291010].value = (
        csa(NumberOfImagesInMosaic=["17"], SliceNormalVector=["0", "0", "1"], X=["odd"]) + b"\0"
    )


def _cut_short(ds: Any) -> None:
    ds[0x00291010].value = ds[0x00291010].value[:150]


def _askew(ds: Any) -> None:
    ds[0x00291010].value = csa(NumberOfImagesInMosaic=["7"], SliceNormalVector=["0", "1", "0"])


def _without_gap(ds: Any) -> None:
    del ds.SpacingBetweenSlices, ds.SliceThickness


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (_without_header, "with a mosaic of several slices, without the private header"),
        (_cut_short, "without the private header"),
        (_of_another_size, "with a mosaic of 17 slices in an image of 54 x 60 pixels"),
        (_askew, "with a mosaic of 7 slices without their direction or distance"),
        (_without_gap, "with a mosaic of 7 slices without their direction or distance"),
    ],
)
def test_a_mosaic_without_a_position_is_refused_in_one_line(
    tmp_path: Path, change: Callable[[Any], None], expected: str
) -> None:
    path = write_mosaic(tmp_path / "m.dcm", affine_of(False, False), change=change)
    with pytest.raises(SourceError) as caught:
        read.open(path)
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "JANE" not in str(caught.value)
