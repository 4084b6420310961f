"""Bodies that a coarse level does without: fewer bodies, rather than thinner ones.

A closed body whose box has a diagonal of less than SMALL errors goes as a whole, smallest first,
as long as all that go have at most MAX_AREA_SHARE of the surface's area. Large bodies have less
area for their volume, so the volume that goes is a smaller share. A body that a cut opens stays:
both tiles would have to decide alike.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.half_edges import measure_areas, measure_boxes
from stereocell.meshes.validity import Topology, find_topology
from stereocell.model.mesh import Mesh

SMALL = 4.0  # errors; at the default errors only lod3's is larger than fragments that stay
MAX_AREA_SHARE = 0.02  # largest share of the surface's area in bodies that go


class SmallBodies:
    """The bodies of a fine surface by their sizes."""

    def __init__(self, mesh: Mesh, topology: Topology | None = None) -> None:
        """`topology`: the mesh's; None: it is found."""
        topology = topology or find_topology(mesh.triangles, len(mesh.positions))
        self._label, bodies = topology.bodies
        at = mesh.positions.astype(np.float64)
        self._areas, self._is_open = measure_areas(
            at, topology.corners, topology.twins, self._label, bodies
        )
        self._diagonals = np.linalg.norm(measure_boxes(at, self._label, bodies), axis=1)

    def find(self, error_um: float) -> NDArray[np.bool_]:
        """Return which vertices of the surface belong to bodies that go, bool (n,).

        error_um  of the level
        """
        small = (self._diagonals < SMALL * error_um) & (self._areas > 0) & ~self._is_open
        order = np.flatnonzero(small)
        order = order[np.argsort(self._diagonals[order], kind="stable")]
        goes = np.zeros(len(small), bool)
        goes[order[np.cumsum(self._areas[order]) <= MAX_AREA_SHARE * self._areas.sum()]] = True
        return goes[self._label]
