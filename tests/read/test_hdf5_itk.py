"""HDF5 by SimpleITK, compared with the MetaImage that it writes from the same image."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import SimpleITK as sitk

from stereocell import read
from stereocell.model.errors import SourceError
from support.dicom_reading import whole
from support.phantoms import f_phantom

TURNED = (0.0, 0.0, -1.0, 0.8, 0.6, 0.0, 0.6, -0.8, 0.0)
MIRRORED = (-1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0)


def write(folder: Path, voxels: Any, direction: Any, *, is_vector: bool = False) -> list[Path]:
    image = sitk.GetImageFromArray(voxels, isVector=is_vector)
    image.SetSpacing((0.25, 0.2, 0.5))
    image.SetOrigin((3.0, -4.0, 5.0))
    image.SetDirection(direction)
    paths = [folder / "a.h5", folder / "a.mha"]
    for path in paths:
        sitk.WriteImage(image, str(path))
    return paths


@pytest.mark.parametrize("direction", [MIRRORED, TURNED])
def test_an_image_of_itk_lies_in_the_patient_as_its_metaimage(
    tmp_path: Path, direction: Any
) -> None:
    found, expected = (read.open(path) for path in write(tmp_path, f_phantom(), direction))
    np.testing.assert_array_equal(whole(found), whole(expected))
    assert found.levels[0].spacing_um == pytest.approx(expected.levels[0].spacing_um)
    np.testing.assert_allclose(found.placement, expected.placement, atol=1e-9)
    assert (found.has_sides, expected.has_sides) == (True, True)
    assert [note for note in found.notes if "mm is assumed, as in files of ITK" in note]


def test_values_of_a_voxel_are_channels(tmp_path: Path) -> None:
    voxels = np.stack([f_phantom(), f_phantom() + 1], axis=-1)
    path, _ = write(tmp_path, voxels, MIRRORED, is_vector=True)
    dataset = read.open(path)
    second = dataset.read(1, dataset.levels[0].box).voxels
    np.testing.assert_array_equal(second, whole(dataset) + 1)


def test_axes_that_the_user_gives_read_the_voxels_as_stored(tmp_path: Path) -> None:
    path, _ = write(tmp_path, f_phantom(), MIRRORED)
    dataset = read.open(path, axes="zyx", spacing_um=(0.5, 0.2, 0.25))
    np.testing.assert_array_equal(whole(dataset), f_phantom())


@pytest.mark.parametrize("name", ["Spacing", "Origin", "Dimension"])
def test_a_part_that_is_missing_is_named(tmp_path: Path, name: str) -> None:
    path, _ = write(tmp_path, f_phantom(), MIRRORED)
    with h5py.File(path, "a") as file:
        del file[f"ITKImage/0/{name}"]
    with pytest.raises(SourceError, match=name):
        read.open(path)
