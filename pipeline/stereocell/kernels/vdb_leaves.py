"""Cut a volume into the leaves of an OpenVDB tree: blocks of 8^3 voxels."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel

LEAF = 8  # voxels along an edge of a leaf
VOXELS = LEAF**3


@kernel
def cut_leaves(
    voxels: NDArray[Any],
    corners: NDArray[np.int64],
    table: NDArray[Any] | None,
    background: Any,
    masks: NDArray[np.uint8],
    active: NDArray[Any],
) -> NDArray[np.int64]:
    """Return the number of active voxels in each leaf, int64 (n,), and fill `masks` and `active`.

    voxels      (z, y, x); voxels outside count as background
    corners     (n, 3), index (x, y, z) of the first voxel of each leaf, which may be negative
    table       (256,), the number that is stored for each voxel, which is then uint8; None: the
                voxels are stored
    background  number of inactive voxels, of the dtype of `active`
    masks       (n, 64), a bit for each voxel of a leaf, in the order (x, y, z) with z first
    active      (512 n,). At the end it starts with the numbers of active voxels, leaf by leaf, in
                the order of the masks
    """
    depth, height, width = voxels.shape
    counts = np.zeros(len(corners), np.int64)
    end = 0
    for leaf in range(len(corners)):
        left, low, back = corners[leaf]
        block = active[end : end + VOXELS]
        is_cut = min(left, low, back) < 0
        if is_cut or left + LEAF > width or low + LEAF > height or back + LEAF > depth:
            for place in range(VOXELS):
                block[place] = background
        for k in range(max(-back, 0), min(LEAF, depth - back)):
            for j in range(max(-low, 0), min(LEAF, height - low)):
                for i in range(max(-left, 0), min(LEAF, width - left)):
                    voxel = voxels[back + k, low + j, left + i]
                    place = (i * LEAF + j) * LEAF + k
                    if table is None:
                        block[place] = voxel
                    else:
                        block[place] = table[voxel]
        count = 0
        for line in range(LEAF * LEAF):
            bits = 0
            for k in range(LEAF):
                value = block[line * LEAF + k]
                is_active = value != background
                block[count] = value  # at or before its place; an inactive value is replaced
                count += is_active
                bits |= is_active << k
            masks[leaf, line] = bits
        counts[leaf] = count
        end += count
    return counts
