"""Sample another channel's intensity on a surface, for options such as `--paint CD31=MART1`.

Each vertex takes the largest value between the surface and a given depth. A marker of the membrane
has its maximum beside the iso-surface, not on it, and a marker of the cytoplasm below it.
Intensities follow the sampled channel's own window, as in its 8-bit volume.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.volume import Volume, xyz_to_zyx


def sample_channel(
    painted: Volume,
    lattice: Lattice,
    mesh: Mesh,
    *,
    intensity_window: tuple[float, float],
    depth_um: float,
) -> NDArray[np.float32]:
    """Return the sampled channel's intensity at each vertex, float32 (n,), 0..1.

    painted           the sampled channel's voxels (z, y, x); they cover `lattice.window`
    mesh              positions and unit normals in world space, um (x, y, z)
    intensity_window  voxel values that become 0 and 1
    depth_um          depth below the surface, along the normal, that is sampled
    """
    points, spacing = mesh.positions, np.asarray(painted.spacing_um)
    voxels = painted.voxels.astype(np.float32)
    at = (xyz_to_zyx(points) - lattice.origin_um) / spacing - np.asarray(lattice.window.start)
    inwards = -xyz_to_zyx(mesh.normals) / spacing
    largest = np.full(len(points), -np.inf, np.float32)
    steps = max(int(np.ceil(depth_um / min(painted.spacing_um))), 1)
    for depth in np.linspace(0.0, depth_um, steps + 1):
        place = (at + depth * inwards).T
        here = ndimage.map_coordinates(voxels, place, order=1, mode="nearest")
        largest = np.maximum(largest, here)
    low, high = intensity_window
    return np.clip((largest - low) / (high - low), 0, 1).astype(np.float32)
