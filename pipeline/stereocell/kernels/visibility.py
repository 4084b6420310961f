"""Ambient visibility of points, by rays through the voxels of a solid."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel

LOWEST = np.float32(0.05)  # least cosine between a ray and the normal


@kernel
def cast_rays(
    solid: NDArray[np.bool_],
    start: NDArray[np.float32],
    up: NDArray[np.float32],
    directions: NDArray[np.float32],
    strides: NDArray[np.float32],
    distances: NDArray[np.float32],
    weights: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Return the visible share of the sky at each point, float32 (n,), 0..1.

    solid       bool (z, y, x)
    start       (n, 3), starts of rays in voxels (z, y, x) plus .5, so that truncation rounds
    up          (n, 3), unit normals (z, y, x)
    directions  (k, 3), unit vectors
    strides     (k, 3), the directions in voxels per um
    distances   (s,), um, at which a ray is examined
    weights     (s,), darkening by a hit at each distance
    """
    nz, ny, nx = solid.shape
    share = np.empty(len(start), np.float32)
    for i in range(len(start)):
        whole, hidden = np.float32(0), np.float32(0)
        for d in range(len(directions)):
            cosine = up[i, 0] * directions[d, 0] + up[i, 1] * directions[d, 1]
            cosine += up[i, 2] * directions[d, 2]
            if cosine <= LOWEST:
                continue
            whole += cosine
            for k in range(len(distances)):
                z = start[i, 0] + distances[k] * strides[d, 0]
                y = start[i, 1] + distances[k] * strides[d, 1]
                x = start[i, 2] + distances[k] * strides[d, 2]
                if not (0 <= z < nz and 0 <= y < ny and 0 <= x < nx):
                    break
                if solid[int(z), int(y), int(x)]:
                    hidden += cosine * weights[k]
                    break
        share[i] = np.float32(1) - hidden / max(whole, np.float32(1e-6))
    return share
