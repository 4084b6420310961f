"""Read DICOM files of tests, and find where their voxels lie."""

import numpy as np
from numpy.typing import NDArray

from stereocell.model.volume import zyx_to_xyz
from stereocell.read.dataset import Dataset
from support.dicom_series import BODIES, scene
from support.reading import whole


def lps_mm(dataset: Dataset) -> NDArray[np.float64]:
    """Return LPS coordinates of every voxel, mm, (z, y, x, 3). World axes are (L, S, -P), um."""
    level = dataset.levels[0]
    index = np.stack(np.meshgrid(*map(np.arange, level.shape), indexing="ij"), axis=-1)
    move = np.array(dataset.placement)
    world = zyx_to_xyz(index * level.spacing_um) @ move[:3, :3].T + move[:3, 3]
    return np.stack([world[..., 0], -world[..., 2], world[..., 1]], axis=-1) / 1000


def error(dataset: Dataset) -> float:
    """Return the largest difference of a voxel from the scene at its position.

    Values of the scene reach about 1000.
    """
    return float(np.abs(whole(dataset) - scene(lps_mm(dataset))).max())


def interpolation_bound(gap_mm: float) -> float:
    """Return the largest error of linear interpolation of the scene over a gap.

    It is h^2 / 8 times the largest curvature, and 1 for rounding.
    """
    return gap_mm**2 / 8 * max(height / sigma**2 for _, sigma, height in BODIES) + 1.0
