"""The sides of a patient in the world, and the clip plane that is active at opening."""

import numpy as np
from numpy.typing import NDArray

from stereocell.model.world_box import WorldPoint

# Unit vectors (x, y, z) to the sides of a patient, in the world of a stage
PATIENT_SIDES = {
    "left": (1.0, 0.0, 0.0),
    "posterior": (0.0, 0.0, -1.0),
    "superior": (0.0, 1.0, 0.0),
}


def opening_plane(boxes: NDArray[np.float64]) -> tuple[WorldPoint, float]:
    """Return the clip plane that halves a specimen along x: its normal (x, y, z), and its offset.

    boxes  (tiles, 2, 3), lower and upper corners (x, y, z), um, world

    The offset is in um of the world.
    """
    return (1.0, 0.0, 0.0), float(boxes[:, 0, 0].min() + boxes[:, 1, 0].max()) / 2
