"""Axes of an image are permuted and reversed while windows are read; voxels are never copied."""

from dataclasses import dataclass, replace

from stereocell.read.acquired import Acquired
from stereocell.read.anatomical_axes import Canonical
from stereocell.read.dataset import VoxelArray
from stereocell.read.flipped_array import FlippedArray
from stereocell.read.image import Image
from stereocell.read.spacing import Grid, Triple


@dataclass(frozen=True, slots=True)
class Turn:
    """The order and direction in which stored axes become z, y and x.

    order  for z, y and x: index of the stored axis (0 z, 1 y, 2 x) that becomes this axis
    flips  for z, y and x: True where the axis runs backwards along its stored axis
    """

    order: tuple[int, int, int] = (0, 1, 2)
    flips: tuple[bool, bool, bool] = (False, False, False)

    @property
    def is_needed(self) -> bool:
        """Whether any axis is permuted or reversed."""
        return self.order != (0, 1, 2) or any(self.flips)


def turned_array(array: VoxelArray, turn: Turn | Canonical) -> VoxelArray:
    """Return an array whose axes are renamed and, where needed, reversed."""
    names, flips = list(array.axes), [False] * len(array.axes)
    for name, stored, flip in zip("zyx", turn.order, turn.flips, strict=True):
        place = array.axes.index("zyx"[stored])
        names[place], flips[place] = name, flip
    turned = FlippedArray(array.array, flips) if any(flips) else array.array
    return VoxelArray(turned, tuple(names))


def turned_grid(grid: Grid, turn: Turn | Canonical) -> Grid:
    """Return the grid of a turned array. Its offset is that of the voxel that is now the first."""
    z, y, x = (grid.shape[axis] for axis in turn.order)
    offset = grid.offset_um
    if offset is not None and grid.spacing_um is not None:
        pairs = zip(offset, grid.spacing_um, grid.shape, strict=True)
        ends = [first + length * (count - 1) for first, length, count in pairs]
        a, b, c = (
            -ends[axis] if flip else offset[axis]
            for axis, flip in zip(turn.order, turn.flips, strict=True)
        )
        offset = (a, b, c)
    c_z, c_y, c_x = (grid.partial_um[axis] for axis in turn.order)
    return replace(
        grid,
        shape=(z, y, x),
        spacing_um=_turned(grid.spacing_um, turn),
        offset_um=offset,
        partial_um=(c_z, c_y, c_x),
    )


def turned_image(image: Image, turn: Turn) -> Image:
    """Return an image with turned levels, and with the axis now perpendicular to its planes."""
    if not turn.is_needed:
        return image
    return replace(
        image,
        arrays=tuple(turned_array(array, turn) for array in image.arrays),
        grids=tuple(turned_grid(grid, turn) for grid in image.grids),
        acquired=Acquired(axis=turn.order.index(image.acquired.axis)),
    )


def _turned(values: Triple | None, turn: Turn | Canonical) -> Triple | None:
    if values is None:
        return None
    z, y, x = (values[axis] for axis in turn.order)
    return z, y, x
