"""Closed copies of tiles, for printing and for booleans.

The mesh that is drawn is open where another tile follows. A copy ends there in a cap, less than a
voxel past the cut: neighbours overlap by that, so that a union has no faces that lie on each other.

A copy is certified as every mesh is; one that simplification left with faults stays unsimplified.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.isosurface.extract import extract_surface
from stereocell.meshes.simplify_valid import simplify_without_defects
from stereocell.meshes.validity import find_defects, label_components
from stereocell.model.lattice import Lattice
from stereocell.model.unit import Closed


def close_tile(
    distance: NDArray[np.float32], lattice: Lattice, *, max_error_um: float
) -> Closed | None:
    """Return the closed surface of the solids of a tile, simplified soundly, in world um.

    None where there are no solids.

    distance float32 (z, y, x), um, positive inside, covers `lattice.window`.
    """
    own = distance[lattice.own.slices_in(lattice.window)]
    fine = extract_surface(own, lattice.alone())
    if not len(fine.triangles):
        return None
    simplified = simplify_without_defects(fine, (), max_error_um=max_error_um)
    defects = find_defects(simplified.mesh).total
    if not defects:
        return Closed(simplified.mesh, 0, simplified.fallbacks)
    every = int(label_components(fine.triangles, len(fine.positions)).max()) + 1
    return Closed(fine, find_defects(fine).total, every)
