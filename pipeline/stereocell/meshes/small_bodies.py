"""Remove small bodies from coarse levels: fewer bodies, rather than thinner ones.

A closed body is removed as a whole if the diagonal of its box is less than SMALL errors. The
smallest are removed first, as long as all removed bodies have at most MAX_AREA_SHARE of the
surface's area. Their share of the volume is smaller still, because large bodies have less area for
their volume. A body that a cut opens stays, because both tiles would have to decide alike.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.half_edges import measure_areas, measure_boxes
from stereocell.meshes.validity import Topology, find_topology
from stereocell.model.mesh import Mesh

# Diagonal of a body's box below which it is small, as a multiple of the level's error. With the
# default errors, only at lod3 is this more than the size of the smallest fragments of a surface.
SMALL = 4.0
MAX_AREA_SHARE = 0.02  # largest share of the surface's area in bodies that are removed


class SmallBodies:
    """The bodies of a fine surface, sorted by size."""

    def __init__(self, mesh: Mesh, topology: Topology | None = None) -> None:
        """Measure the bodies of a mesh. topology: the mesh's; None: it is computed."""
        topology = topology or find_topology(mesh.triangles, len(mesh.positions))
        self._label, bodies = topology.bodies
        at = mesh.positions.astype(np.float64)
        self._areas, self._is_open = measure_areas(
            at, topology.corners, topology.twins, self._label, bodies
        )
        self._diagonals = np.linalg.norm(measure_boxes(at, self._label, bodies), axis=1)

    def find(self, error_um: float) -> NDArray[np.bool_]:
        """Return which vertices of the surface belong to removed bodies, bool (n,).

        error_um  largest error of the level of detail
        """
        small = (self._diagonals < SMALL * error_um) & (self._areas > 0) & ~self._is_open
        order = np.flatnonzero(small)
        order = order[np.argsort(self._diagonals[order], kind="stable")]
        goes = np.zeros(len(small), bool)
        goes[order[np.cumsum(self._areas[order]) <= MAX_AREA_SHARE * self._areas.sum()]] = True
        return goes[self._label]
