"""Convert a grid in the patient to canonical axes, and those to the world.

Canonical voxels (z, y, x) have the axes nearest to (anterior, inferior, left). Stored voxels are
only flipped and permuted, never resampled. The remaining rotation, near the identity, and offset
are the placement. In the world +x is the patient's left, +y superior and +z anterior, so the
patient faces the viewer. A point in LPS (DICOM's axes: left, posterior, superior) becomes
(L, S, -P), a proper rotation.

References: DICOM PS3.3 C.7.6.2.1.1 (patient-based coordinate system).
"""

from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from stereocell.model.rigid_transform import Matrix, to_matrix
from stereocell.model.spacing import Spacing

# rows: directions of canonical z, y and x (anterior, inferior, left) in LPS
_CANONICAL = np.array([(0.0, -1.0, 0.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)])
# (3, 3) for column vectors: from LPS to the world
LPS_TO_WORLD = np.array([(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)])
_UM_PER_MM = 1000.0
_PLANES = ("sagittal", "coronal", "axial")  # indexed by the LPS axis nearest to the normal
_OBLIQUE = np.cos(np.radians(2.0))  # cosine; a normal farther from its axis makes the plane oblique


@dataclass(frozen=True, slots=True)
class Canonical:
    """The map from stored axes to canonical ones.

    order       for z, y and x: index (0..2) of the stored axis that becomes this axis
    flips       for z, y and x: True where the axis runs backwards along its stored axis
    spacing_um  (z, y, x), um
    placement   rows of a (4, 4) matrix for column vectors, um: from the pipeline's world, whose
                origin is the centre of canonical voxel (0, 0, 0), to the patient's world
    """

    order: tuple[int, int, int]
    flips: tuple[bool, bool, bool]
    spacing_um: Spacing
    placement: Matrix

    def apply(self, voxels: NDArray[np.generic]) -> NDArray[np.generic]:
        """Return stored voxels (three axes, any dtype) on canonical axes (z, y, x), not copied."""
        turned = voxels.transpose(self.order)
        return turned[tuple(slice(None, None, -1 if flip else 1) for flip in self.flips)]


def canonical_of(affine: NDArray[np.float64], shape: tuple[int, int, int]) -> Canonical:
    """Return the canonical form of a grid with orthogonal axes.

    affine  (4, 4) for column vectors, float64: from (i, j, k, 1) of the stored axes to LPS in mm
    shape   voxels along the stored axes (i, j, k)
    """
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    axes = affine[:3, :3] / spacing
    likeness = _CANONICAL @ axes  # signed cosines; rows: canonical axes, columns: stored axes
    best = max(permutations(range(3)), key=lambda p: sum(abs(likeness[i, p[i]]) for i in range(3)))
    order = (best[0], best[1], best[2])
    backwards = [bool(likeness[i, axis] < 0) for i, axis in enumerate(order)]
    first = np.zeros(3)
    for axis, flip in zip(order, backwards, strict=True):
        first[axis] = shape[axis] - 1 if flip else 0
    origin = LPS_TO_WORLD @ (affine[:3, :3] @ first + affine[:3, 3]) * _UM_PER_MM
    signs = np.where(backwards, -1.0, 1.0)
    z, y, x = (LPS_TO_WORLD @ (axes[:, axis] * s) for axis, s in zip(order, signs, strict=True))
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, -y, z], axis=1)  # image rows run downwards
    matrix[:3, 3] = origin
    sz, sy, sx = (float(spacing[axis]) * _UM_PER_MM for axis in order)
    return Canonical(
        order,
        (backwards[0], backwards[1], backwards[2]),
        (sz, sy, sx),
        to_matrix((matrix + 0.0).tolist()),  # adding 0.0 turns -0.0 into 0.0
    )


def plane_name(normal: NDArray[np.float64]) -> str:
    """Return the name of planes with this normal (3,), LPS: `axial`, `oblique sagittal`, ..."""
    along = np.abs(normal)
    name = _PLANES[int(along.argmax())]
    return name if along.max() >= _OBLIQUE else f"oblique {name}"
