"""Place the vertices of a level of detail nearer to the fine surface than collapses leave them.

A collapse keeps one of an edge's two vertices, and its position. A vertex that is left stands for
all fine vertices that were merged into it. Here it moves to the point that is nearest to the planes
of their triangles, in the least-squares sense. The collapses themselves stay half-edge collapses,
so that they can be repeated around locked vertices, and so that each level descends from unmoved
vertices of the level before.

At the same triangles, the mean distance to the fine surface falls by 8 to 15 % at lod0, and by 9 to
28 % at coarser levels. See docs/decisions/placed-vertices.md.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.placement import find_places, shorten_moves, sum_planes
from stereocell.meshes.simplify import SHARPEST_DEG
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Mesh

# Weight of a move's squared length, as a share of the weight of all planes of the vertex. Distances
# on vessels, brain cells and an MR head are least from .03 to .1, and up to 10 % larger at .003.
SOFTNESS = 0.05
HALVINGS = 4  # number of times that a move is shortened; the last time, it becomes 0
# Terms of a vertex's quadric that contain the axis x, y or z; see `sum_planes`
TERMS = np.array([[0, 3, 4, 6], [1, 3, 5, 7], [2, 4, 5, 8]])

Points = NDArray[np.float64]


class FinePlanes:
    """The planes of a fine surface's triangles, near which vertices of its levels are placed.

    corners  int32 (m, 3), the triangles of the surface
    caps     planes of caps, which stay flat
    """

    def __init__(self, mesh: Mesh, corners: NDArray[np.int32], caps: tuple[Plane, ...]) -> None:
        self._positions, self._corners, self._caps = mesh.positions, corners, caps

    def find_moves(
        self,
        start: Points,
        triangles: NDArray[np.int32],
        owners: NDArray[np.int32],
        max_move_um: float,
    ) -> Points:
        """Return moves of a level's vertices, float64 (n, 3), um, towards the fine surface.

        start        float64 (n, 3), um, positions that are positions of fine vertices
        triangles    int32 (m, 3), the level's
        owners       int32, the level's vertex that stands for each fine vertex; -1: none does
        max_move_um  largest length of a move

        No triangle turns by more than 60 degrees, and none gets a smaller angle below SHARPEST_DEG.
        Vertices of caps move within their planes.
        """
        sums = sum_planes(self._positions.astype(np.float64), self._corners, owners, start)
        for axis, value in self._caps:
            on_cap = np.flatnonzero(start[:, axis] == np.float32(value))
            sums[on_cap[:, None], TERMS[axis]] = 0.0
        moves = find_places(sums, SOFTNESS, max_move_um)
        sharpest = float(np.cos(np.radians(SHARPEST_DEG)))
        shorten_moves(start, triangles, moves, sharpest, HALVINGS)
        return moves
