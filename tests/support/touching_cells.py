"""Touching cells of known shape: points nearest to a cell's centre, within a ball round it."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

RADIUS_UM = 6.0


def touching_cells(
    shape: tuple[int, int, int], spacing_um: tuple[float, float, float], apart_um: float = 8.0
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Return labels (z, y, x) and the cells' centres (n, 3), um, (z, y, x).

    The interface of two cells is the plane midway between their centres; free surfaces are spheres.
    """
    spacing = np.array(spacing_um)
    box = (np.array(shape) - 1) * spacing
    rng = np.random.default_rng(5)
    centres: list[NDArray[np.float64]] = []
    for place in rng.uniform(RADIUS_UM + 1, box - RADIUS_UM - 1, (4000, 3)):
        if all(np.linalg.norm(place - other) > apart_um for other in centres):
            centres.append(place)
    grid = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1) * spacing
    distance, nearest = cKDTree(centres).query(grid)
    return np.where(distance <= RADIUS_UM, nearest + 1, 0).astype(np.int32), np.array(centres)
