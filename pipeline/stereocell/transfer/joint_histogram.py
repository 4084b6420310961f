"""Count a channel's voxels by value and gradient magnitude, the domain of 2D transfer functions.

The gradient magnitude is the step of intensity (0..1 of the window) over two finest voxel spacings,
by central differences: 2 h |grad f|, where h is the finest spacing. At a voxel's centre it equals
the result of a shader that takes trilinear samples at a distance of h on both sides along each
axis: with r = h / spacing of that axis, f(+r) - f(-r) = r (f[1] - f[-1]). Each channel has a number
`gradient_max`, the step of the last row.

References
Kindlmann & Durkin, "Semi-automatic generation of transfer functions for direct volume rendering",
IEEE Symposium on Volume Visualization 1998; Kniss, Kindlmann & Hansen, "Multidimensional transfer
functions for interactive volume rendering", IEEE TVCG 8(3), 2002.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.filters.codes import codes_of, every_code, has_codes
from stereocell.kernels.value_counts import count_steps, look_up, measure_steps
from stereocell.model.spacing import Spacing

ROWS, COLUMNS = 64, 256  # gradient magnitudes, and values of 8 bits
STEEPEST = 3**0.5  # the largest possible step: the whole window along each axis
# Rows over 0..STEEPEST before gradient_max is known; each is half a step of 8 bits
FINE_ROWS = 1024
ENERGY_SHARE = 0.995  # share of the squared steps that lies below gradient_max
SMALLEST_MAX = 0.05  # share of the window, 13 steps of 8 bits; finer rows would not differ


def find_steps(voxels: NDArray[np.uint8], spacing_um: Spacing) -> NDArray[np.float32]:
    """Return the gradient magnitudes of all voxels except the outermost; 255 stands for 1.

    voxels      uint8 (z, y, x)
    spacing_um  (z, y, x); only the ratios matter
    result      float32 (z - 2, y - 2, x - 2)
    """
    ratios = np.array([min(spacing_um) / spacing for spacing in spacing_um], np.float32)
    z, y, x = (n - 2 for n in voxels.shape)
    steps = np.empty((z, y, x), np.float32)
    measure_steps(_plain(voxels), ratios, steps)
    return steps


def count_joint(
    voxels: NDArray[np.uint8],
    spacing_um: Spacing,
    *,
    gradient_max: float,
    rows: int = ROWS,
    every: int = 1,
) -> NDArray[np.int64]:
    """Return how many voxels have each gradient magnitude and value, int64 (rows, COLUMNS).

    voxels        uint8 (z, y, x); the outermost voxels count only as neighbours, and an axis of
                  fewer than 3 voxels has its ends repeated
    spacing_um    (z, y, x); only the ratios matter
    gradient_max  step of the last row, which also counts steeper voxels; row j stands for
                  j / (rows - 1) of it, and column k for the value k / 255
    every         only one of this many slices along z is counted
    """
    short = [(1, 1) if n < 3 else (0, 0) for n in voxels.shape]
    voxels = np.pad(voxels, short, mode="edge") if (1, 1) in short else voxels
    factor = np.float32((rows - 1) / (255 * gradient_max))
    counts = np.zeros((rows, COLUMNS), np.int64)
    # The voxels are counted slice by slice, since slices fit into the processor's cache.
    for z in range(1, len(voxels) - 1, every):
        near = _plain(voxels[z - 1 : z + 2])
        count_steps(find_steps(near, spacing_um)[0], near[1], factor, counts)
    return counts


def _plain(voxels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return voxels as kernels take them: contiguous and writable; a copy only if necessary."""
    return np.require(voxels, np.uint8, ["C", "W"])


def choose_gradient_max(fine: NDArray[np.int64]) -> float:
    """Return the step of a channel's last row, rounded up to 3 digits.

    fine  int64 (FINE_ROWS, COLUMNS), counts over 0..STEEPEST

    Nearly all of the squared steps lie below it. Voxels without a boundary, which are the most,
    have no weight, and a few hot voxels have little.
    """
    steps = np.linspace(0, STEEPEST, len(fine))
    energy = np.cumsum(fine.sum(axis=1) * steps**2)
    found = steps[np.searchsorted(energy, ENERGY_SHARE * energy[-1])] if energy[-1] > 0 else 0.0
    return float(np.ceil(1000 * max(found, SMALLEST_MAX) - 1e-9) / 1000)


def rebin(fine: NDArray[np.int64], gradient_max: float) -> NDArray[np.int64]:
    """Return counts in FINE_ROWS over 0..STEEPEST as counts in ROWS over 0..gradient_max.

    fine    int64 (FINE_ROWS, COLUMNS)
    result  int64 (ROWS, COLUMNS)
    """
    steps = np.linspace(0, STEEPEST, len(fine))
    row = np.minimum(steps / gradient_max * (ROWS - 1) + 0.5, ROWS - 1).astype(np.intp)
    counts = np.zeros((ROWS, fine.shape[1]), np.int64)
    np.add.at(counts, row, fine)
    return counts


def log_scaled(counts: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return counts as an image on a logarithmic scale, uint8: 0 for none, 255 for the most."""
    most = int(counts.max(initial=0))
    if most == 0:
        return np.zeros(counts.shape, np.uint8)
    picture = np.rint(255 * np.log1p(counts) / np.log1p(most)).astype(np.uint8)
    return np.where(counts > 0, np.maximum(picture, 1), 0).astype(np.uint8)


def to_eight_bits(voxels: NDArray[Any], window: tuple[float, float]) -> NDArray[np.uint8]:
    """Return voxels as in the 8-bit volumes: the window's ends become 0 and 255.

    voxels  any real dtype and shape (z, ...), voxel values
    window  lowest and highest voxel value
    result  uint8, of the same shape
    """
    result = np.empty(voxels.shape, np.uint8)
    table = None
    if has_codes(voxels.dtype) and voxels.ndim > 1 and voxels.size > 1 << 16:
        table = _scaled(every_code(voxels.dtype), window)
    for z, plane in enumerate(voxels):  # one plane at a time, because float32 is large
        if table is None:
            result[z] = _scaled(plane, window)
        else:
            look_up(codes_of(plane), table, result[z].reshape(-1))
    return result


def _scaled(voxels: NDArray[Any], window: tuple[float, float]) -> NDArray[np.uint8]:
    low, high = window
    share = (voxels.astype(np.float32) - np.float32(low)) / np.float32(high - low)
    return np.rint(np.clip(share, 0, 1) * 255).astype(np.uint8)
