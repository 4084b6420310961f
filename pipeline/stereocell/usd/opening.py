"""The sides of a patient in the world, and the plane that a specimen opens cut by."""

import numpy as np
from numpy.typing import NDArray

from stereocell.model.world_box import WorldPoint

# The sides of a patient in the world of a stage: unit vectors (x, y, z)
PATIENT_SIDES = {
    "left": (1.0, 0.0, 0.0),
    "posterior": (0.0, 0.0, -1.0),
    "superior": (0.0, 1.0, 0.0),
}


def opening_plane(boxes: NDArray[np.float64]) -> tuple[WorldPoint, float]:
    """Return the plane that a specimen opens cut by: its normal, and its offset in um.

    boxes  (tiles, 2, 3), lower and upper corners (x, y, z), um, world
    """
    return (1.0, 0.0, 0.0), float(boxes[:, 0, 0].min() + boxes[:, 1, 0].max()) / 2
