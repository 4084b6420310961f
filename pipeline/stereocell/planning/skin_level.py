"""The level of skin in a CT of an unknown scale, as one that was mapped to 8 bits.

Such a volume does not state its mapping, so no level in Hounsfield units can be computed. Skin is
the outermost surface. Where the mapping's window cut the air off, all of the air has one value and
the outermost tissue lies next to it. No threshold between two classes finds that: in a window of
soft tissue the two classes are fat and muscle.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.isosurface.array_levels import find_array_levels
from stereocell.model.volume import Volume

BASIS_OF_AIR = "half-way between the air, which the window cut off, and the dimmest tissue"
BASIS_OF_LEVEL = "at its outermost surface"
BASIS_OF_CLASSES = "half-way between its dark and bright voxels"
# Air is cut off where this share of the voxels has the darkest value, and where the range next to
# it, this share of all values, holds so much fewer. Air that has noise, beside padding, fills it.
# Measured on two trunks in seven windows: at most .05 where air is cut off, else over .1.
_CUT_SHARE, _NEXT_RANGE, _NEXT_SHARE = 0.02, 0.05, 0.1
_DIMMEST = 0.05  # quantile of the voxels brighter than air that stands for the dimmest tissue


def find_skin_level(volume: Volume) -> tuple[float, str]:
    """Return the level of skin in voxel values, and where it comes from, for people."""
    voxels = volume.voxels
    darkest, brightest = (float(value) for value in np.quantile(voxels, (0.0, 0.999)))
    beyond = darkest + _NEXT_RANGE * (brightest - darkest)
    at_darkest = np.count_nonzero(voxels == darkest)
    beside = np.count_nonzero((voxels > darkest) & (voxels <= beyond))
    if at_darkest >= _CUT_SHARE * voxels.size and beside < _NEXT_SHARE * at_darkest:
        tissue = voxels[voxels > beyond]
        if tissue.size:
            return (darkest + float(np.quantile(tissue, _DIMMEST))) / 2.0, BASIS_OF_AIR
    clear = find_array_levels(volume, modality="CT").levels.clear
    if clear:
        return float(clear[0].value), BASIS_OF_LEVEL
    return _halfway(voxels), BASIS_OF_CLASSES


def _halfway(voxels: NDArray[Any]) -> float:
    """Return the value half-way between the means of Otsu's two classes."""
    from skimage.filters import threshold_otsu  # slow to import, and few sources need it

    values = voxels.astype(np.float64)  # float32 has too few steps for the bins of a narrow range
    is_dark = values <= threshold_otsu(values)
    return float(values[is_dark].mean() + values[~is_dark].mean()) / 2.0
