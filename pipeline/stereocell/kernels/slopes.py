"""Directions of steepest descent of a field, at points between its voxels."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel


@kernel
def find_downhill(
    field: NDArray[np.float32],
    at: NDArray[np.float64],
    spacing: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Return the unit vector of steepest descent at each point, float32 (n, 3), (z, y, x).

    field    float32 (z, y, x), at least 2 voxels each way
    at       float64 (n, 3), voxels (z, y, x); points beyond the ends are moved to the ends
    spacing  voxel spacing (z, y, x)

    Slopes are central differences at voxels, one-sided at the ends, and linear in between.
    """
    nz, ny, nx = field.shape
    result = np.empty((len(at), 3), np.float32)
    for i in range(len(at)):
        z, y, x = (
            min(max(at[i, 0], 0.0), nz - 1.0),
            min(max(at[i, 1], 0.0), ny - 1.0),
            min(max(at[i, 2], 0.0), nx - 1.0),
        )
        iz, iy, ix = min(int(z), nz - 2), min(int(y), ny - 2), min(int(x), nx - 2)
        fz, fy, fx = z - iz, y - iy, x - ix
        gz, gy, gx = 0.0, 0.0, 0.0
        for a in range(iz, iz + 2):
            for b in range(iy, iy + 2):
                for c in range(ix, ix + 2):
                    share = (fz if a > iz else 1 - fz) * (fy if b > iy else 1 - fy)
                    share *= fx if c > ix else 1 - fx
                    z0, z1 = max(a - 1, 0), min(a + 1, nz - 1)
                    y0, y1 = max(b - 1, 0), min(b + 1, ny - 1)
                    x0, x1 = max(c - 1, 0), min(c + 1, nx - 1)
                    gz += share * (field[z1, b, c] - field[z0, b, c]) / (z1 - z0)
                    gy += share * (field[a, y1, c] - field[a, y0, c]) / (y1 - y0)
                    gx += share * (field[a, b, x1] - field[a, b, x0]) / (x1 - x0)
        gz, gy, gx = -gz / spacing[0], -gy / spacing[1], -gx / spacing[2]
        length = max(np.sqrt(gz * gz + gy * gy + gx * gx), 1e-20)
        result[i, 0], result[i, 1], result[i, 2] = gz / length, gy / length, gx / length
    return result
