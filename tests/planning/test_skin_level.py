"""The plan advises the level of skin for a CT that was mapped to 8 bits."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.planning.ct_evidence import find_ct_evidence
from stereocell.read.open_dataset import open as open_dataset
from support import nifti_files

SHAPE = (16, 60, 60)  # slices, rows, columns
AIR, FAT, MUSCLE, BONE = -1000, -100, 60, 700


def _trunk() -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return a limb of bone, muscle and fat in Hounsfield units, and the voxels inside its skin."""
    _, y, x = np.indices(SHAPE)
    away = np.hypot(y - 30, x - 28)
    hu = np.select([away < 5, away < 16, away < 22], [BONE, MUSCLE, FAT], AIR).astype(float)
    noise = np.random.default_rng(0).normal(0, 12, SHAPE)
    return ndimage.gaussian_filter(hu, (0, 0.7, 0.7)) + noise, away < 22


def _mapped(hu: NDArray[np.float64], low: float, high: float) -> NDArray[np.uint8]:
    return (np.clip((hu - low) / (high - low), 0, 1) * 255).round().astype(np.uint8)


@pytest.mark.parametrize("window", [(-160, 240), (-200, 300), (-500, 1500), (-1024, 2000)])
def test_the_level_advised_for_8_bits_keeps_the_fat_below_the_skin(
    tmp_path: Path, window: tuple[int, int]
) -> None:
    hu, body = _trunk()
    voxels = _mapped(hu, *window)
    affine = np.diag([1.0, 1.0, 1.0, 1.0])
    source = nifti_files.write(tmp_path / "a.nii.gz", affine, voxels.transpose(2, 1, 0))
    evidence = find_ct_evidence(open_dataset(source))
    level = float(evidence.flags.partition("--iso-value 0=")[2].split()[0])
    solid = voxels > level
    dice = 2 * np.count_nonzero(solid & body) / (solid.sum() + body.sum())
    assert dice > 0.92  # without the fat the Dice coefficient is .69
    assert "no scaling to Hounsfield units is known" in evidence.basis
    assert ("the window cut off" in evidence.basis) == (window[0] > -1000)


def test_padding_beside_air_with_noise_is_not_taken_for_air(tmp_path: Path) -> None:
    hu, body = _trunk()
    voxels = _mapped(hu, -1024, 2000)
    voxels[:, :, :4] = voxels[:, :, -4:] = 0  # outside of the scanner's field of view
    affine = np.diag([1.0, 1.0, 1.0, 1.0])
    source = nifti_files.write(tmp_path / "a.nii.gz", affine, voxels.transpose(2, 1, 0))
    evidence = find_ct_evidence(open_dataset(source))
    level = float(evidence.flags.partition("--iso-value 0=")[2].split()[0])
    solid = voxels > level
    assert 2 * np.count_nonzero(solid & body) / (solid.sum() + body.sum()) > 0.92
