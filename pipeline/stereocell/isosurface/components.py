"""The connected components of a mask: their sizes, and their triangle counts."""

from dataclasses import dataclass
from typing import Any, Literal

import cc3d
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Components:
    """Connected components, numbered from 1; arrays (n,) hold component k at index k - 1.

    labels       unsigned integers (z, y, x), 0 outside
    diagonal_um  diagonal of the box of its voxel centres, in um
    whole        whether the component stays clear of the mask's ends
    """

    labels: NDArray[Any]
    diagonal_um: NDArray[np.float64]
    whole: NDArray[np.bool_]

    def faces(self) -> NDArray[np.int64]:
        """Return how many triangles an iso-surface around each component has, int64 (n,).

        The count is nearly exact: the surface has a vertex on each lattice edge that leaves the
        component, and a closed surface has twice as many triangles as vertices, less 4 for a sphere
        and plus 4 for each handle (Euler).
        """
        vertices = np.zeros(len(self.diagonal_um) + 1, np.int64)
        for axis in range(self.labels.ndim):
            ahead = np.moveaxis(self.labels, axis, 0)
            low, high = ahead[:-1], ahead[1:]
            leaves = (low == 0) != (high == 0)
            # one of the two labels is 0
            vertices += np.bincount((low[leaves] | high[leaves]).ravel(), minlength=len(vertices))
        return 2 * vertices[1:]


def find_components(
    mask: NDArray[np.bool_], spacing_um: tuple[float, float, float], connectivity: Literal[6, 26]
) -> Components:
    """Return the connected components of a mask.

    mask          bool (z, y, x)
    spacing_um    (z, y, x)
    connectivity  6: voxels that share a face; 26: also an edge or a corner
    """
    labels = cc3d.connected_components(mask, connectivity=connectivity)
    found = cc3d.statistics(labels, no_slice_conversion=True)["bounding_boxes"]
    boxes = np.asarray(found, np.int64).reshape(-1, 3, 2)[1:]  # (label, axis, first and last)
    diagonal = np.linalg.norm((boxes[:, :, 1] - boxes[:, :, 0]) * np.asarray(spacing_um), axis=1)
    end = np.asarray(mask.shape) - 1
    whole = np.all((boxes[:, :, 0] > 0) & (boxes[:, :, 1] < end), axis=1)
    return Components(labels, diagonal, np.asarray(whole))
