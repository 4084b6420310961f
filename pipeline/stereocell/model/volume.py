"""Voxels with their position, and the only place where image axes become world axes."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stereocell.model.spacing import Point, Spacing


@dataclass(frozen=True, slots=True)
class Volume:
    """The voxels of one channel in a window.

    voxels      (z, y, x), integer or float32
    spacing_um  distance between voxels in um, (z, y, x)
    origin_um   CENTRE of voxel (0, 0, 0) in um, (z, y, x)
    slice_axis  axis perpendicular to the source's images: 0, 1 or 2 for z, y or x; see
                model/image_plane.py
    """

    voxels: NDArray[Any]
    spacing_um: Spacing
    origin_um: Point = (0.0, 0.0, 0.0)
    slice_axis: int = 0


def zyx_to_xyz(points_um: ArrayLike) -> NDArray[np.float64]:
    """Return world positions (x, y, z) of image positions (z, y, x).

    points_um  (..., 3), um
    result     float64 (..., 3), um

    The world is right-handed, x right, y up, z towards the viewer (glTF, USD with Y up). Image
    rows grow downwards, so y changes its sign here and nowhere else. A caller that maps triangles
    must swap their winding too.

    >>> zyx_to_xyz((1.0, 2.0, 3.0))
    array([ 3., -2.,  1.])
    """
    points = np.asarray(points_um, dtype=np.float64)
    return np.stack([points[..., 2], -points[..., 1], points[..., 0]], axis=-1)


def xyz_to_zyx(points_um: ArrayLike) -> NDArray[np.float64]:
    """Return image positions (z, y, x) of world positions (x, y, z); float64 (..., 3), um."""
    return zyx_to_xyz(points_um)  # the swap is its own inverse
