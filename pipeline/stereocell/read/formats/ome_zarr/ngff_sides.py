"""Find the sides of an OME-Zarr image in a body from its axes' anatomical orientation (RFC-4).

An axis states the direction in which its index grows, such as `left-to-right`. Three axes that
state three different directions place the image in the patient's world, as DICOM does.

References: https://ngff.openmicroscopy.org/rfc/4
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stereocell.model.rigid_transform import IDENTITY, Matrix
from stereocell.read.acquired import Acquired
from stereocell.read.anatomical_axes import canonical_of
from stereocell.read.dataset import VoxelArray
from stereocell.read.spacing import Grid
from stereocell.read.turn import turned_array, turned_grid

_UM_PER_MM = 1000.0
# side -> the axis of LPS (left, posterior, superior) on which it lies, and the sign there
_SIDES = {
    "left": (0, 1), "right": (0, -1),
    "posterior": (1, 1), "anterior": (1, -1),
    "dorsal": (1, 1), "ventral": (1, -1),
    "superior": (2, 1), "inferior": (2, -1),
    "cranial": (2, 1), "rostral": (2, 1), "caudal": (2, -1),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Sided:
    """Levels on canonical axes, and their place in the patient's world."""

    arrays: tuple[VoxelArray, ...]
    grids: tuple[Grid, ...]
    placement: Matrix = IDENTITY
    has_sides: bool = False
    acquired: Acquired = Acquired()  # noqa: RUF009  (frozen)
    notes: tuple[str, ...] = ()


def with_sides(
    arrays: tuple[VoxelArray, ...], grids: tuple[Grid, ...], orientations: Sequence[str]
) -> Sided:
    """Return the levels on canonical axes, if their orientations are known.

    orientations  orientations of z, y and x, such as `left-to-right`; empty: not stated
    """
    if not any(orientations):
        return Sided(arrays, grids)
    directions = [_direction(text) for text in orientations]
    axes = {axis for axis, _ in filter(None, directions)}
    if len(axes) < len(orientations):
        stated = ", ".join(text or "none" for text in orientations)
        note = (
            f"orientation of z, y, x: found {stated:.200}, expected three different directions in "
            "a body: it is not used, so the sides are unknown"
        )
        return Sided(arrays, grids, notes=(note,))
    canonical = canonical_of(_affine(directions, grids[0]), grids[0].shape)
    return Sided(
        tuple(turned_array(array, canonical) for array in arrays),
        tuple(turned_grid(grid, canonical) for grid in grids),
        canonical.placement,
        has_sides=True,
        acquired=Acquired(axis=canonical.order.index(0)),
    )


def _direction(text: str) -> tuple[int, int] | None:
    """Return axis and sign in LPS of the direction in which an index grows; None: unknown."""
    start, _, end = text.partition("-to-")
    if start not in _SIDES or end not in _SIDES or _SIDES[start][0] != _SIDES[end][0]:
        return None
    return _SIDES[end] if _SIDES[start] != _SIDES[end] else None


def _affine(directions: Sequence[tuple[int, int] | None], grid: Grid) -> np.ndarray:
    """Return the (4, 4) matrix from (z, y, x, 1) of the stored grid to LPS in mm."""
    spacing = grid.spacing_um or (1.0, 1.0, 1.0)
    offset = grid.offset_um or (0.0, 0.0, 0.0)
    affine = np.eye(4)
    affine[:3, :3] = 0.0
    for column, found in enumerate(directions):
        assert found is not None
        axis, sign = found
        affine[axis, column] = sign * spacing[column] / _UM_PER_MM
        affine[axis, 3] = sign * offset[column] / _UM_PER_MM
    return affine
