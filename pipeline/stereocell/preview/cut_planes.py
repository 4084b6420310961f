"""Cut a dataset into pictures across one axis: which way is up, and pixels that are square.

The planes of the grid are read a slab at a time, as the source's chunks lie, so that no chunk is
decoded twice. Where slices were uneven or tilted, the grid is interpolated; then the source's own
images are shown, as they are, as long as the whole volume is asked for.
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
LONGEST_PX = 8192  # a side of a picture that is enlarged to square pixels
_UNSEEN = 0.5  # pixels by which a picture may be too long without being resampled


@dataclass(frozen=True, eq=False)
class Cut:
    """Pictures across one axis.

    view       the way to look
    shape      of a picture: pixels (rows, columns)
    pixel_um   between (rows, columns), um
    first_um   float64 (n, 3): the world's (x, y, z) of each picture's first pixel
    steps_um   float64 (2, 3): in the world, from a pixel to the one below, to the one on its right
    planes     the pictures in order: (rows, columns), grey values
    are_own    they are the source's own images, and not the grid's planes
    """

    view: View
    shape: tuple[int, int]
    pixel_um: tuple[float, float]
    first_um: NDArray[np.float64]
    steps_um: NDArray[np.float64]
    planes: Iterator[NDArray[Any]]
    are_own: bool


def choose_view(views: Sequence[View], axis: int, plane: str, shown: str) -> View:
    """Return the view of a plane's name; `acquired` is the one across `axis` (of z, y, x).

    Raises UsageError for an axial plane of microscopy, or an xy plane of a patient.
    """
    if plane == ACQUIRED:
        return next(view for view in views if view.order[0] == axis)
    found = [view for view in views if view.name == plane]
    if not found:
        named = ", ".join(sorted(view.name for view in views))
        what = "no place in a body" if plane in PLANES[1:4] else "a place in a body"
        raise UsageError(f"--plane {plane}: {shown} states {what}, expected {ACQUIRED}, {named}")
    return found[0]


def cut_planes(dataset: Dataset, plan: Plan, channel: int, plane: str) -> Cut:
    """Return the pictures of the plan's region of a channel. Raises UsageError for a wrong plane.

    channel  index in the dataset
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
        # of a flipped axis the last voxel is first; a pixel's edge is where the voxel's was
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
    """Return the pixels (rows, columns) of a picture of this plane, and their size in um.

    The wider spacing becomes the finer one, but for what is longer than LONGEST_PX; the size of
    a pixel then differs between the two by less than half of one over the whole picture.

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
    """Return where pictures, their rows and their columns run: `slices`, `rows`, `columns`."""
    if not is_patient:
        slices, rows, columns = ("zyx"[axis] for axis in cut.view.order)
        return {"slices": slices, "rows": rows, "columns": columns}
    _, right, _, bottom = cut.view.ends
    slices = ("anterior", "inferior", "left")[cut.view.order[0]]
    return {"slices": slices, "rows": _SIDES[bottom], "columns": _SIDES[right]}


def is_patient(plan: Plan) -> bool:
    """Return whether the voxels have a place in a body."""
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
    """Yield the region's voxels (z, y, x) by layers of chunks across an axis."""
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
    """Return a plane with so many pixels (rows, columns), linearly interpolated."""
    if plane.shape == shape:
        return plane
    picture = Image.fromarray(np.ascontiguousarray(plane, np.float32))
    return np.asarray(picture.resize(shape[::-1], Image.Resampling.BILINEAR))
