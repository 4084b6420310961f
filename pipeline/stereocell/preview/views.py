"""The three ways to look at a volume: which axis is cut, which way is up, what stands at the edges.

A patient is shown as radiologists do: from the front and from the feet, so that the patient's right
is on the picture's left; the nose points up in axial planes and to the left in sagittal ones. Or,
as neurologists prefer, with right on the right. Voxels (z, y, x) of a patient run to the front, the
feet and the left (read/anatomical_axes.py).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.rigid_transform import IDENTITY, Matrix


@dataclass(frozen=True, slots=True)
class View:
    """One way to look.

    order  axes (of z, y, x): the cut one, the picture's rows, its columns
    flips  whether rows, columns run against their axis
    ends   what stands at the picture's left, right, top, bottom
    """

    name: str
    order: tuple[int, int, int]
    flips: tuple[bool, bool]
    ends: tuple[str, str, str, str]

    def plane(self, plane: NDArray[Any]) -> NDArray[Any]:
        """Return a plane (rows, columns), along the axes, as the picture has it: a view."""
        down, right = (slice(None, None, -1 if flip else 1) for flip in self.flips)
        return plane[down, right]

    def points(self, points: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.float64]:
        """Return places (..., 2) in voxels along rows and columns, as the picture has them."""
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
    """Return the views of a dataset, by its place: of a patient where it has one."""
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
