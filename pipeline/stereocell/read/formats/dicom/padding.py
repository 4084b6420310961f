"""Replace pixels outside the image: Pixel Padding Value and Range Limit of DICOM.

CT fills the area outside its circle with a value such as -2000, which the rescale turns into -3024.
It was never measured, and it distorts window, histogram and threshold. So padding becomes the
smallest grey value of the other pixels of all slices at that time point. (With all slices, a slice
with few dark pixels makes no step in the background.) Two kinds of padding stay unchanged:

- Values within the range of the other pixels, because they don't stretch it. They can't be
  distinguished from measured values: some writers name values as padding that their images contain.
- Grey value 0 below all others: no signal in MR and PET, often named as padding. A brain extracted
  onto 0 would otherwise get the value of its darkest voxel as background.

If all pixels are padding, there is no other value, and they stay unchanged.

References: DICOM PS3.3 C.7.5.1.1.2.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.formats.dicom.frame import Encoding


def is_padding(
    contained: NDArray[Any], stored: NDArray[Any], encoding: Encoding
) -> NDArray[np.bool_] | None:
    """Return a mask of the pixels that are padding; None: no pixel is.

    contained  values with all bits of their containers, integers of any shape
    stored     the same values reduced to the stored bits, and inverted if `encoding` says so; same
               shape
    """
    if encoding.padding is None or encoding.bits == 0:
        return None
    low, high = encoding.padding
    least, most = encoding.stored_range
    if low < least or high > most:  # only all bits of the container can hold this padding
        mask = (contained >= low) & (contained <= high)
    elif encoding.is_inverted:
        mask = (stored >= least + most - high) & (stored <= least + most - low)
    else:
        mask = (stored >= low) & (stored <= high)
    return mask if mask.any() else None


class Padding:
    """The padding masks of planes, one bit per pixel, and the range of the other pixels."""

    def __init__(self) -> None:
        self._masks: dict[int, NDArray[np.uint8]] = {}
        self._low, self._high = np.inf, -np.inf

    def add(self, place: int, plane: NDArray[np.generic], mask: NDArray[np.bool_] | None) -> None:
        """Record the plane (rows, columns) of grey values at index `place`, and its mask."""
        others = plane if mask is None else plane[~mask]
        if others.size:
            self._low = min(self._low, float(others.min()))
            self._high = max(self._high, float(others.max()))
        if mask is not None:
            self._masks[place] = np.packbits(mask)

    def fill(self, planes: NDArray[np.generic]) -> None:
        """Replace the padding of planes (n, rows, columns) with its new value, in place."""
        if self._low > self._high:
            return
        for place, packed in self._masks.items():
            plane = planes[place]
            mask = np.unpackbits(packed, count=plane.size).astype(bool).reshape(plane.shape)
            mask &= (plane < self._low) | (plane > self._high)
            if self._low > 0:
                mask &= plane != 0
            plane[mask] = self._low
