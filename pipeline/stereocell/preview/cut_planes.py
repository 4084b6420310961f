"""Cut a dataset into pictures across one axis, the right way up and with square pixels.

The grid's planes are read in slabs that match the source's chunks, so that no chunk is decoded
twice. If the source's slices were uneven or tilted, the grid is interpolated. In this case the
source's own images are shown unchanged, provided that the whole volume is wanted.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from stereocell.model.errors import UsageError
from stereocell.model.rigid_transform import IDENTITY
from stereocell.model.tiling import Box
from stereocell.model.volume import zyx_to_xyz
from stereocell.planning.plan import Plan
from stereocell.preview.views import View, views_of
from stereocell.read import Dataset

ACQUIRED = "acquired"
PLANES = (ACQUIRED, "axial", "coronal", "sagittal", "xy", "xz", "yz")
LONGEST_PX = 8192  # pixels, longest side to which a picture is enlarged for square pixels
_UNSEEN = 0.5  # pixels by which a picture may be too long before it is resampled


@dataclass(frozen=True, eq=False)
class Cut:
    """Pictures of slices across one axis of a volume.

    view       direction and orientation of the pictures
    shape      pixels (rows, columns) of a picture
    pixel_um   distance of neighbouring (rows, columns), um
    first_um   float64 (n, 3): world position (x, y, z) of each picture's first pixel
    steps_um   float64 (2, 3): world vectors from a pixel to the one below and to the one right
    planes     the pictures in order: (rows, columns), grey values
    are_own    the pictures are the source's own images, not planes of the grid
    """

    view: View
    shape: tuple[int, int]
    pixel_um: tuple[float, float]
    first_um: NDArray[np.float64]
    steps_um: NDArray[np.float64]
    planes: Iterator[NDArray[Any]]
    are_own: bool


def choose_view(views: Sequence[View], axis: int, plane: str, shown: str) -> View:
    """Return the view with a plane's name; `acquired` means the view across `axis` (of z, y, x).

    Raises UsageError for an axial plane of microscopy data, or an xy plane of a patient.
    """
    if plane == ACQUIRED:
        return next(view for view in views if view.order[0] == axis)
    found = [view for view in views if view.name == plane]
    if not found:
        named = ", ".join(sorted(view.name for view in views))
        what = "no" if plane in PLANES[1:4] else "a"
        raise UsageError(
            f"--plane is {plane}, but {shown} states {what} position in a patient, expected "
            f"{ACQUIRED}, {named}"
        )
    return found[0]


def cut_planes(dataset: Dataset, plan: Plan, channel: int, plane: str) -> Cut:
    """Return the pictures of a channel in the plan's region. Raises UsageError for a wrong plane.

    channel  index of the channel in the dataset
    plane    one of PLANES
    """
    acquired = dataset.acquired
    views = views_of(plan.placement, is_neurological=plan.settings.plan.neurological)
    view = choose_view(views, acquired.axis, plane, dataset.shown)
    axis, down, right = view.order
    level = dataset.levels[plan.level]
    is_whole = plan.level == 0 and plan.region == level.box
    are_own = acquired.first is not None and view.order[0] == acquired.axis and is_whole
    if are_own and acquired.first is not None and acquired.load is not None:
        images = acquired.load(dataset.time)
        first, shape = acquired.first.copy(), images.shape
        slabs: Iterator[NDArray[Any]] = iter([images])
    else:
        shape = plan.region.shape
        first = np.repeat([plan.region.start], shape[axis], axis=0).astype(np.float64)
        first[:, axis] += np.arange(shape[axis])
        slabs = _slabs(dataset, channel, plan, axis)
    signs = [-1.0 if flip else 1.0 for flip in view.flips]
    spacing = np.array(plan.spacing_um)
    size, pixel = square_pixels((shape[down], shape[right]), (spacing[down], spacing[right]))
    um = np.array(plan.origin_um) + first * spacing
    steps = np.zeros((2, 3))
    for row, (of, sign) in enumerate(zip((down, right), signs, strict=True)):
        # A flipped axis begins at its last voxel. Resized pixels keep the outer edge of the voxels.
        um[:, of] += (shape[of] - 1) * spacing[of] if sign < 0 else 0.0
        um[:, of] += sign * (pixel[row] - spacing[of]) / 2
        steps[row, of] = sign * pixel[row]
    move = np.array(plan.placement)
    return Cut(
        view,
        size,
        pixel,
        zyx_to_xyz(um) @ move[:3, :3].T + move[:3, 3],
        zyx_to_xyz(steps) @ move[:3, :3].T,
        (_resized(view.plane(p), size) for slab in slabs for p in slab.transpose(view.order)),
        are_own,
    )


def square_pixels(
    shape: tuple[int, int], spacing_um: tuple[float, float]
) -> tuple[tuple[int, int], tuple[float, float]]:
    """Return the pixels (rows, columns) of a plane's picture, and their size in um.

    Pixels get the finer of the two spacings, or a coarser one if the picture would be longer than
    LONGEST_PX. Rows and columns may differ in size by less than half a pixel over the picture.

    >>> square_pixels((10, 100), (2.0, 0.5))
    ((40, 100), (0.5, 0.5))
    """
    (rows, columns), (down, right) = shape, spacing_um
    if abs(down - right) * max(shape) <= _UNSEEN * max(down, right):
        return (rows, columns), (float(down), float(right))
    longest = max(rows * down, columns * right)
    pixel = max(min(down, right), longest / max(LONGEST_PX, rows, columns))
    tall, wide = (max(1, round(n * s / pixel)) for n, s in zip(shape, spacing_um, strict=True))
    return (tall, wide), (float(rows * down / tall), float(columns * right / wide))


def extent_words(cut: Cut, *, is_patient: bool) -> dict[str, str]:
    """Return the directions of `slices`, `rows` and `columns`: axes, or sides of the patient."""
    if not is_patient:
        slices, rows, columns = ("zyx"[axis] for axis in cut.view.order)
        return {"slices": slices, "rows": rows, "columns": columns}
    _, right, _, bottom = cut.view.ends
    slices = ("anterior", "inferior", "left")[cut.view.order[0]]
    return {"slices": slices, "rows": _SIDES[bottom], "columns": _SIDES[right]}


def is_patient(plan: Plan) -> bool:
    """Return whether the source states a position in a patient."""
    return plan.placement != IDENTITY


_SIDES = {
    "L": "left",
    "R": "right",
    "A": "anterior",
    "P": "posterior",
    "S": "superior",
    "I": "inferior",
}


def _slabs(dataset: Dataset, channel: int, plan: Plan, axis: int) -> Iterator[NDArray[Any]]:
    """Yield the region's voxels (z, y, x) in slabs of one chunk's thickness across an axis."""
    chunk = max(1, dataset.arrays[plan.level].chunk[axis])
    region = plan.region
    begin, end = region.start[axis], region.stop[axis]
    while begin < end:
        stop = min(end, (begin // chunk + 1) * chunk)
        low, high = list(region.start), list(region.stop)
        low[axis], high[axis] = begin, stop
        box = Box((low[0], low[1], low[2]), (high[0], high[1], high[2]))
        yield dataset.read(channel, box, plan.level).voxels
        begin = stop


def _resized(plane: NDArray[Any], shape: tuple[int, int]) -> NDArray[Any]:
    """Resize a plane to `shape` (rows, columns) by linear interpolation."""
    if plane.shape == shape:
        return plane
    picture = Image.fromarray(np.ascontiguousarray(plane, np.float32))
    return np.asarray(picture.resize(shape[::-1], Image.Resampling.BILINEAR))
