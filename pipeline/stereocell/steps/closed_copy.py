"""Make closed copies of tiles, for 3D printing and for boolean operations.

The drawn mesh of a tile is open towards its neighbours. The copy ends there in a cap, less than a
voxel past the cut. So the copies of neighbouring tiles overlap, and their union has no coincident
faces.

A copy is checked like every mesh. If simplification leaves defects, the copy is not simplified.
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
    """Return the closed surface of the tile's solid, simplified without defects, in world um.

    distance      float32 (z, y, x), um, positive inside; covers `lattice.window`
    max_error_um  largest distance between the simplified and the original surface

    Returns None if nothing lies inside.
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
