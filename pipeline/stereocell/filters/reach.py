"""How far the filters of `denoise` reach: each result depends on no voxel beyond.

Plans and stages need these numbers without the filters, whose library is slow to import.
"""

from stereocell.model.image_plane import MAX_RATIO, back_of_three, first_of_three
from stereocell.model.spacing import Spacing

# Voxels to each side; the clip of hot voxels looks at neighbours within this distance
HOT_VOXEL_REACH = 1
MEDIAN_REACH = 1  # voxels to each side in the plane of the images that the median uses
SMOOTHING_REACH = 4.0  # radius of the Gaussian, in sigmas


def median_reach(spacing_um: Spacing, slice_axis: int) -> tuple[int, int, int]:
    """Return how many voxels (z, y, x) the median reaches to each side; 0, 0, 0: no median."""
    _, row, column = first_of_three(spacing_um, slice_axis)
    reach = MEDIAN_REACH if max(row, column) <= MAX_RATIO * min(row, column) else 0
    return back_of_three((0, reach, reach), slice_axis)


def median_size(spacing_um: Spacing, slice_axis: int) -> tuple[int, int, int]:
    """Return the size (z, y, x) of the median in voxels; 1, 1, 1: no median."""
    z, y, x = (2 * reach + 1 for reach in median_reach(spacing_um, slice_axis))
    return z, y, x
