"""Find the level of skin in a CT whose scale is unknown, for example after mapping to 8 bits.

The volume does not state its mapping, so no level in Hounsfield units can be computed. Skin is the
outermost surface. If the mapping's window cut the air off, all air has the same value, and the
outermost tissue has the next higher values. A threshold between two classes would not find it: in
a window for soft tissue the two classes are fat and muscle.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.volume import Volume

BASIS_OF_AIR = "half-way between the air, which the window cut off, and the dimmest tissue"
BASIS_OF_LEVEL = "at its outermost surface"
BASIS_OF_CLASSES = "half-way between its dark and bright voxels"
# Shares, 0..1. Air is cut off if at least _CUT_SHARE of the voxels have the darkest value, and the
# next _NEXT_RANGE of all values holds less than _NEXT_SHARE of that number. Noisy air fills that
# range. In two trunks and seven windows it held at most .05 with air cut off, and over .1 without.
_CUT_SHARE, _NEXT_RANGE, _NEXT_SHARE = 0.02, 0.05, 0.1
_DIMMEST = 0.05  # quantile of the voxels brighter than air that stands for the dimmest tissue


def find_skin_level(volume: Volume) -> tuple[float, str]:
    """Return the level of skin, a voxel value, and words on how it was found."""
    voxels = volume.voxels
    darkest, brightest = (float(value) for value in np.quantile(voxels, (0.0, 0.999)))
    beyond = darkest + _NEXT_RANGE * (brightest - darkest)
    at_darkest = np.count_nonzero(voxels == darkest)
    beside = np.count_nonzero((voxels > darkest) & (voxels <= beyond))
    if at_darkest >= _CUT_SHARE * voxels.size and beside < _NEXT_SHARE * at_darkest:
        tissue = voxels[voxels > beyond]
        if tissue.size:
            return (darkest + float(np.quantile(tissue, _DIMMEST))) / 2.0, BASIS_OF_AIR
    from stereocell.isosurface.array_levels import find_array_levels  # slow to import

    clear = find_array_levels(volume, modality="CT").levels.clear
    if clear:
        return float(clear[0].value), BASIS_OF_LEVEL
    return _halfway(voxels), BASIS_OF_CLASSES


def _halfway(voxels: NDArray[Any]) -> float:
    """Return the value half-way between the means of Otsu's two classes."""
    from skimage.filters import threshold_otsu  # slow to import, and few sources need it

    values = voxels.astype(np.float64)  # float32 is too coarse for the bins of a narrow range
    is_dark = values <= threshold_otsu(values)
    return float(values[is_dark].mean() + values[~is_dark].mean()) / 2.0
