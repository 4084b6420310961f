"""Resample planes that lie unevenly, or drift sideways, onto an even grid, linearly."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.read.plane_stack import StackLayout


def resample_stack(planes: NDArray[np.generic], layout: StackLayout) -> NDArray[np.generic]:
    """Return the grid's voxels (plane, row, column), resampled from a stack's planes.

    planes  (n, rows, columns), any dtype, in the order of `layout.places`; the result keeps it

    Voxels outside all planes take the lowest value of the planes. Integers are rounded.
    """
    fill = float(planes.min())
    grid = np.empty(layout.shape, planes.dtype)
    before = _moved(planes[0], layout.places[0], layout, fill)
    grid[0] = _as(before, planes.dtype)
    for place, (low, high) in enumerate(pairwise(layout.places[:, 0]), start=1):
        after = _moved(planes[place], layout.places[place], layout, fill)
        last = layout.shape[0] - 1 if place == len(planes) - 1 else int(np.floor(high + 1e-9))
        for k in range(int(np.floor(low + 1e-9)) + 1, last + 1):
            share = min((k - low) / (high - low), 1.0)
            grid[k] = _as(before + np.float32(share) * (after - before), planes.dtype)
        before = after
    return grid


def _moved(
    plane: NDArray[np.generic], place: NDArray[np.float64], layout: StackLayout, fill: float
) -> NDArray[np.float32]:
    """Return a plane on the grid's rows and columns, float32, with `fill` outside the plane."""
    _, rows, columns = layout.shape
    whole = np.floor(place[1:] + 1e-9).astype(int)
    moved = np.full((rows + 1, columns + 1), fill, np.float32)
    moved[whole[0] : whole[0] + plane.shape[0], whole[1] : whole[1] + plane.shape[1]] = plane
    for axis in (0, 1):
        part = np.float32(max(place[1 + axis] - whole[axis], 0.0))
        if part > 1e-6:
            # the last row and column are padding, so no value wraps round
            neighbour = np.roll(moved, 1, axis)
            moved = (1 - part) * moved + part * neighbour
    return moved[:rows, :columns]


def resample_sheared(
    voxels: NDArray[np.generic], affine: NDArray[np.float64]
) -> tuple[NDArray[np.generic], NDArray[np.float64]]:
    """Return voxels resampled from a skew grid onto an orthogonal one, and its affine (4, 4).

    voxels  (i, j, k), any dtype, which the result keeps
    affine  (4, 4) for column vectors, float64: from (i, j, k, 1) to mm

    The new axes are the nearest orthogonal ones (polar decomposition), the spacings stay, and the
    new grid contains all of the old one.
    """
    shape, orthogonal = orthogonal_grid(voxels.shape, affine)
    back = np.linalg.inv(affine) @ orthogonal
    fill = float(voxels.min())
    moved = ndimage.affine_transform(
        voxels.astype(np.float32), back[:3, :3], back[:3, 3], shape, order=1, cval=fill
    )
    return _as(moved, voxels.dtype), orthogonal


def orthogonal_grid(
    shape: tuple[int, ...], affine: NDArray[np.float64]
) -> tuple[tuple[int, int, int], NDArray[np.float64]]:
    """Return shape and affine (4, 4) of the orthogonal grid around a skew one; reads no voxels.

    shape   voxels (i, j, k) of the skew grid
    affine  (4, 4) for column vectors: from (i, j, k, 1) to mm
    """
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    u, _, vt = np.linalg.svd(affine[:3, :3] / spacing)
    axes = u @ vt
    corners = np.array(np.meshgrid(*[(0, n - 1) for n in shape[:3]], indexing="ij"))
    places = (affine[:3, :3] @ corners.reshape(3, -1)).T @ axes / spacing
    low, high = places.min(axis=0), places.max(axis=0)
    x, y, z = (int(n) for n in np.ceil(high - low - 1e-6) + 1)
    orthogonal = np.eye(4)
    orthogonal[:3, :3] = axes * spacing
    orthogonal[:3, 3] = affine[:3, 3] + axes @ (low * spacing)
    return (x, y, z), orthogonal


def _as(values: NDArray[np.float32], dtype: np.dtype[np.generic]) -> NDArray[np.generic]:
    return values.astype(dtype) if dtype.kind == "f" else np.rint(values).astype(dtype)
