"""Count voxels inside a solid whose distance field covers only some planes of voxels."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel

Field = NDArray[np.float32]
Flags = NDArray[np.bool_]
Places = NDArray[np.int64]
Shares = NDArray[np.float32]


@kernel
def count_inside(
    distance: Field, is_above: Flags, low: Places, high: Places, share: Shares
) -> tuple[int, int]:
    """Return how many voxels lie inside a solid, and how many of these are flagged.

    distance   (z, y, x), positive inside, linear between its planes
    is_above   (depth, height, width), flags of the voxels
    low, high  (depth + height + width,), for the voxels along z, y and x: the planes of `distance`
               between which they lie
    share      of the same length: share of the way from `low` to `high`, 0..1
    """
    depth, height, width = is_above.shape
    _, rows, columns = distance.shape
    across, row = np.empty((rows, columns), np.float32), np.empty(columns, np.float32)
    inside = covered = 0
    for z in range(depth):
        before, behind = distance[low[z]], distance[high[z]]
        for y in range(rows):
            for x in range(columns):
                across[y, x] = before[y, x] + (behind[y, x] - before[y, x]) * share[z]
        for y in range(height):
            at = depth + y
            above, below = across[low[at]], across[high[at]]
            for x in range(columns):
                row[x] = above[x] + (below[x] - above[x]) * share[at]
            flags = is_above[z, y]
            for x in range(width):
                at = depth + height + x
                left = row[low[at]]
                is_in = left + (row[high[at]] - left) * share[at] > 0
                inside += is_in
                covered += is_in and flags[x]
    return inside, covered
