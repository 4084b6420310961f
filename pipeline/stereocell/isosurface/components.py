"""The connected components of a mask: their sizes and their triangle counts.

Components that are only measured are found here, by runs of voxels. If each voxel needs a label,
cc3d labels the volume. A mask of 512 x 512 x 194 voxels takes .08 to .21 s here and .40 to .47 s
with cc3d. The labels of cc3d take 203 MB, and it counts neither faces nor the components at the
mask's ends.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.runs import find_runs, join_runs, mark_runs, measure_components
from stereocell.model.spacing import Spacing

_Ints = NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class Components:
    """Connected components, numbered from 0. Arrays (n,) hold component k at index k.

    diagonal_um  diagonal of the box of its voxel centres, in um
    whole        whether the component touches no end of the mask
    voxels       number of its voxels
    """

    diagonal_um: NDArray[np.float64]
    whole: NDArray[np.bool_]
    voxels: NDArray[np.int64]
    _faces: NDArray[np.int64]
    _shape: tuple[int, int, int]
    _runs: tuple[NDArray[np.int64], _Ints, _Ints, _Ints]  # row, start, stop, component of each run

    def faces(self) -> NDArray[np.int64]:
        """Return how many triangles an iso-surface around each component has, int64 (n,).

        The count is nearly exact: the surface has a vertex on each lattice edge that leaves the
        component, and a closed surface has twice as many triangles as vertices, less 4 for a sphere
        and plus 4 for each handle (Euler).
        """
        return 2 * self._faces

    def mask_of(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the voxels of the chosen components (n,), bool (z, y, x)."""
        mask = np.zeros(self._shape, bool)
        mark_runs(*self._runs, chosen, mask)
        return mask


def find_components(
    mask: NDArray[np.bool_], spacing_um: Spacing, connectivity: Literal[6, 26]
) -> Components:
    """Return the connected components of a mask.

    mask          bool (z, y, x)
    spacing_um    (z, y, x)
    connectivity  6: voxels that share a face; 26: also an edge or a corner
    """
    depth, height, width = mask.shape
    first, start, stop = find_runs(np.ascontiguousarray(mask))
    labels, touching, count = join_runs(first, start, stop, height, connectivity == 26)
    boxes, voxels, faces = measure_components(
        first, start, stop, labels, touching, count, (depth, height, width)
    )
    low, high = boxes[:, :3].astype(np.int64), boxes[:, 3:].astype(np.int64)
    diagonal = np.linalg.norm((high - low) * np.asarray(spacing_um), axis=1)
    whole = np.all((low > 0) & (high < np.asarray(mask.shape) - 1), axis=1)
    return Components(
        diagonal,
        np.asarray(whole),
        voxels,
        faces,
        (depth, height, width),
        (first, start, stop, labels),
    )
