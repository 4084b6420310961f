"""The noun that all stages share: voxels and their place, and the one axis swap."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, slots=True)
class Volume:
    """One channel's window.

    `voxels` (z, y, x), integer or float32. `spacing_um` and `origin_um` are (z, y, x) in
    micrometres; the CENTRE of voxel (0, 0, 0) lies at the origin.
    """

    voxels: NDArray[Any]
    spacing_um: tuple[float, float, float]
    origin_um: tuple[float, float, float] = (0.0, 0.0, 0.0)


def zyx_to_xyz(points_um: ArrayLike) -> NDArray[np.float64]:
    """Return world positions (x, y, z) in um of image positions (z, y, x) in um; shape (..., 3).

    The world is right-handed, x right, y up, z towards the viewer (glTF, USD with Y up). Image
    rows grow downwards, so y changes its sign here and nowhere else; whoever maps triangles by
    it swaps their winding too.
    """
    points = np.asarray(points_um, dtype=np.float64)
    return np.stack([points[..., 2], -points[..., 1], points[..., 0]], axis=-1)


def xyz_to_zyx(points_um: ArrayLike) -> NDArray[np.float64]:
    """Return image positions (z, y, x) of world positions (x, y, z); shape (..., 3)."""
    return zyx_to_xyz(points_um)  # swapping the ends and turning y over is its own inverse
