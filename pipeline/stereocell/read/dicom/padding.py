"""Pixels that are no part of the image: Pixel Padding Value and Range Limit of DICOM.

PS3.3 C.7.5.1.1.2. CT fills what lies outside its circle with, say, -2000, which the rescale makes
-3024: a value that nothing measured, and that pulls window, histogram and threshold off. So padding
becomes the smallest grey value of the other pixels of all slices at that point in time (of all, so
that a slice with few dark pixels is no step in the background). Two kinds stay as they are:

- what lies within the range of the other pixels, which it doesn't stretch: the values can't be told
  from measured ones, since writers name as padding what their images hold as well
- grey value 0 below all others: no signal in MR and PET, often named as padding; a brain cut out on
  0 would else lie on the value of its darkest voxel

Where all pixels are padding there is nothing to go by, and they stay.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.dicom.frame import Encoding


def is_padding(
    contained: NDArray[Any], stored: NDArray[Any], encoding: Encoding
) -> NDArray[np.bool_] | None:
    """Return which pixels are padding; None: none are.

    contained  values with all bits of their containers
    stored     the same values of the stored bits alone, inverted if `encoding` says so
    """
    if encoding.padding is None or encoding.bits == 0:
        return None
    low, high = encoding.padding
    least, most = encoding.stored_range
    if low < least or high > most:  # a value that only the whole container can hold
        mask = (contained >= low) & (contained <= high)
    elif encoding.is_inverted:
        mask = (stored >= least + most - high) & (stored <= least + most - low)
    else:
        mask = (stored >= low) & (stored <= high)
    return mask if mask.any() else None


class Padding:
    """Which pixels of planes are padding, a bit each, and the range of the others."""

    def __init__(self) -> None:
        self._masks: dict[int, NDArray[np.uint8]] = {}
        self._low, self._high = np.inf, -np.inf

    def add(self, place: int, plane: NDArray[np.generic], mask: NDArray[np.bool_] | None) -> None:
        """Take note of the plane (rows, columns) of grey values at index `place`."""
        others = plane if mask is None else plane[~mask]
        if others.size:
            self._low = min(self._low, float(others.min()))
            self._high = max(self._high, float(others.max()))
        if mask is not None:
            self._masks[place] = np.packbits(mask)

    def fill(self, planes: NDArray[np.generic]) -> None:
        """Give the padding of planes (n, rows, columns) its new value, in place."""
        if self._low > self._high:
            return
        for place, packed in self._masks.items():
            plane = planes[place]
            mask = np.unpackbits(packed, count=plane.size).astype(bool).reshape(plane.shape)
            mask &= (plane < self._low) | (plane > self._high)
            if self._low > 0:
                mask &= plane != 0
            plane[mask] = self._low
