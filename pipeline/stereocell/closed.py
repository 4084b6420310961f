"""Closed copies of tiles, for printing and for booleans.

The mesh that is drawn is open where another tile follows. A copy ends there in a cap, less than a
voxel past the cut: neighbours overlap by that, so that a union has no faces that lie on each other.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.mend import simplify_soundly
from stereocell.mesh import Mesh
from stereocell.surface import extract_surface
from stereocell.tiling import Box


def close_tile(
    distance: NDArray[np.float32],
    window: Box,
    lattice: Box,
    spacing_um: tuple[float, float, float],
    origin_um: tuple[float, float, float],
    max_error_um: float,
) -> Mesh:
    """Return the closed surface of the solids inside `lattice`, simplified soundly, in world um.

    distance (z, y, x), um, positive inside, covers `window`; the lattice ends what is built, as far
    as the surface knows.
    """
    inner = (
        slice(a - w, b - w)
        for a, b, w in zip(lattice.start, lattice.stop, window.start, strict=True)
    )
    own = distance[tuple(inner)]
    fine = extract_surface(own, lattice, lattice, lattice, spacing_um, origin_um)
    if not len(fine.triangles):
        return fine
    return simplify_soundly(fine, (), max_error_um).mesh
