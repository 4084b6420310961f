"""Positions of the voxels of an exported volume, as image formats state them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class VoxelGrid:
    """A lattice of voxels; x is the fastest axis.

    size        voxels (x, y, z)
    spacing     float64 (3,), distance of neighbours along each axis, in `unit`
    origin      float64 (3,), centre of voxel (0, 0, 0), in `unit`
    direction   float64 (3, 3); each column is the unit vector of an axis
    unit        um, mm or m
    is_patient  whether positions are DICOM's: towards the left, the back and upwards
    """

    size: tuple[int, int, int]
    spacing: NDArray[np.float64]
    origin: NDArray[np.float64]
    direction: NDArray[np.float64]
    unit: str
    is_patient: bool

    @property
    def affine(self) -> NDArray[np.float64]:
        """The matrix (4, 4) from an index (i, j, k, 1) to its position."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.direction * self.spacing
        matrix[:3, 3] = self.origin
        return matrix
