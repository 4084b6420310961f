"""Boxes in the world: x to the right, y up, z towards the viewer, in micrometres."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stereocell.model.volume import zyx_to_xyz

WorldPoint = tuple[float, float, float]  # (x, y, z), um


def world_box(
    first_um: ArrayLike, last_um: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower and upper corner (x, y, z), world um, of the box between two points.

    first_um, last_um  image positions (z, y, x), um
    """
    corners = zyx_to_xyz(np.stack([first_um, last_um])) + 0.0  # adding 0.0 turns -0.0 into 0.0
    return corners.min(axis=0), corners.max(axis=0)


def move_box(
    low: NDArray[np.float64], high: NDArray[np.float64], matrix: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return lower and upper corner (x, y, z), um, of the axis-aligned box around a moved box.

    low, high  corners (x, y, z), um
    matrix     (4, 4) for row vectors
    """
    picks = np.array(np.meshgrid(*[[0, 1]] * 3)).reshape(3, -1).T
    corners = np.where(picks == 0, low, high) @ matrix[:3, :3] + matrix[3, :3]
    return corners.min(axis=0), corners.max(axis=0)


def box_around(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the box (2, 3) around boxes (n, 2, 3): lower and upper corners (x, y, z)."""
    return np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
