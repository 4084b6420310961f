"""The three views of a volume: the axis that is cut, the orientation, and letters at the edges.

A patient is shown by radiologists' convention, from the front and from the feet. The patient's
right is on the picture's left. The nose points up in axial planes, and to the left in sagittal
ones. By neurologists' convention, right is on the right. Voxels (z, y, x) of a patient run to the
front, to the feet and to the left (read/anatomical_axes.py).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.rigid_transform import IDENTITY, Matrix


@dataclass(frozen=True, slots=True)
class View:
    """The orientation of slices across one axis of a volume.

    order  indices of axes (of z, y, x): the one that is cut, the rows' and the columns'
    flips  whether rows and columns run against their axes
    ends   letters at the picture's left, right, top and bottom
    """

    name: str
    order: tuple[int, int, int]
    flips: tuple[bool, bool]
    ends: tuple[str, str, str, str]

    def plane(self, plane: NDArray[Any]) -> NDArray[Any]:
        """Turn a plane (rows, columns) to the picture's orientation, as a numpy view."""
        down, right = (slice(None, None, -1 if flip else 1) for flip in self.flips)
        return plane[down, right]

    def points(self, points: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.float64]:
        """Turn points (..., 2), in voxels along rows and columns, to the picture's orientation."""
        last = np.asarray(shape) - 1.0
        return np.where(self.flips, last - points, points)


MICROSCOPE = (
    View("xy", (0, 1, 2), (False, False), ("", "x →", "", "y ↓")),
    View("xz", (1, 0, 2), (False, False), ("", "x →", "", "z ↓")),
    View("yz", (2, 1, 0), (False, False), ("", "z →", "", "y ↓")),
)
PATIENT = (
    View("coronal", (0, 1, 2), (False, False), ("R", "L", "S", "I")),
    View("axial", (1, 0, 2), (True, False), ("R", "L", "A", "P")),
    View("sagittal", (2, 1, 0), (False, True), ("A", "P", "S", "I")),
)


def views_of(placement: Matrix, *, is_neurological: bool = False) -> tuple[View, View, View]:
    """Return the views for a dataset: a patient's if its placement states a patient's position."""
    if placement == IDENTITY:
        return MICROSCOPE
    coronal, axial, sagittal = PATIENT
    if is_neurological:
        coronal, axial = _mirrored(coronal), _mirrored(axial)
    return coronal, axial, sagittal


def _mirrored(view: View) -> View:
    left, right, top, bottom = view.ends
    down, across = view.flips
    return replace(view, flips=(down, not across), ends=(right, left, top, bottom))
