"""The images that a source stores: the axis perpendicular to them, and their places in the grid."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.anatomical_axes import Canonical


@dataclass(frozen=True, eq=False)
class Acquired:
    """The planes that a source stores.

    axis   0, 1 or 2 for z, y or x: the axis that is perpendicular to the images
    first  float64 (n, 3): the first pixel of each image, (z, y, x) in voxels of the grid; images
           are in rising order along `axis`. None: the images are the grid's planes
    load   returns the n images of a time point with the grid's axes (z, y, x), stacked along
           `axis`; None where `first` is None
    """

    axis: int = 0
    first: NDArray[np.float64] | None = None
    load: Callable[[int], NDArray[Any]] | None = None


def turned_places(
    places: NDArray[np.float64],
    plane_shape: tuple[int, int],
    shape: tuple[int, int, int],
    canonical: Canonical,
) -> NDArray[np.float64]:
    """Return the first pixels of planes after `canonical` has flipped and permuted their axes.

    places       (n, 3): first pixels as stored, in voxels (plane, row, column) of the stored grid
    plane_shape  pixels (rows, columns)
    shape        voxels of the stored grid (planes, rows, columns)
    """
    own = np.array((1, *plane_shape))
    mirrored = np.array(shape) - own - places
    turns = zip(canonical.order, canonical.flips, strict=True)
    turned = np.stack([(mirrored if flip else places)[:, axis] for axis, flip in turns], axis=1)
    return turned[::-1] if canonical.flips[canonical.order.index(0)] else turned
