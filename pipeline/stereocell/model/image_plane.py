"""Find the plane of a source's images, and turn arrays so that the slices come first.

A volume is turned into the patient's frame after reading, so the images of a CT may be
perpendicular to any axis. Operations in the plane of an image (a median, the noise between
neighbours, runs of padding) work on arrays that `slices_first` has turned.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from stereocell.model.spacing import Spacing

T = TypeVar("T")

_EDGE = 64  # edge of a block that is copied at once; its values fit into a processor's cache

# Ratio of two spacings above which voxels along the coarser axis do not count as neighbours. A
# filter across them would mix unrelated structures.
MAX_RATIO = 2.0


def find_slice_axis(stated: int, spacing_um: Spacing) -> int:
    """Return the axis perpendicular to the images of a volume: 0, 1 or 2 for z, y or x.

    stated      axis that the source states, or that its reader assumes
    spacing_um  voxel spacing (z, y, x)

    If one axis is much coarser than both others, it is returned instead of the stated one. The
    volume may have been resampled along other axes than the scanner's.
    """
    _, middle, coarsest = sorted(spacing_um)
    return spacing_um.index(coarsest) if coarsest > MAX_RATIO * middle else stated


def slices_first(array: NDArray[Any], slice_axis: int) -> NDArray[Any]:
    """Return an array (z, y, x) as (slice, row, column), a NumPy view."""
    return np.moveaxis(array, slice_axis, 0)


def slices_back(array: NDArray[Any], slice_axis: int) -> NDArray[Any]:
    """Return an array (slice, row, column) as (z, y, x), a NumPy view."""
    return np.moveaxis(array, 0, slice_axis)


def in_order(array: NDArray[Any], dtype: DTypeLike | None = None) -> NDArray[Any]:
    """Return a contiguous array of the same values, which is the array itself if it is that.

    array  (n, m, k), possibly a turned view
    dtype  of the result; None: the array's own

    A turned array is copied block by block. Otherwise each value that is read would bring another
    line of memory into the processor's cache, which takes four times as long.
    """
    wanted = array.dtype if dtype is None else np.dtype(dtype)
    if abs(array.strides[-1]) == array.itemsize:
        return np.ascontiguousarray(array, wanted)
    copy = np.empty(array.shape, wanted)
    for place in product(*(range(0, n, _EDGE) for n in array.shape)):
        block = tuple(slice(start, start + _EDGE) for start in place)
        copy[block] = array[block]
    return copy


def first_of_three(values: Sequence[T], slice_axis: int) -> tuple[T, T, T]:
    """Return values by (z, y, x) in the order (slice, row, column)."""
    rows, columns = (value for axis, value in enumerate(values) if axis != slice_axis)
    return values[slice_axis], rows, columns


def back_of_three(values: Sequence[T], slice_axis: int) -> tuple[T, T, T]:
    """Return values by (slice, row, column) in the order (z, y, x)."""
    along, *in_plane = values
    in_plane.insert(slice_axis, along)
    z, y, x = in_plane
    return z, y, x
