"""Read the voxel spacing from an array's attributes, under the names that writers use.

`element_size_um` of PlantSeg and ilastik is z, y, x in um. Other attributes count only beside a
unit: `resolution` is in nm in CREMI's files and voxels per length in others.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from stereocell.read.spacing import Triple, um_per
from stereocell.read.stated_numbers import numbers_of
from stereocell.read.stated_texts import text_of

_SIZES = ("resolution", "spacing", "voxel_size", "voxel_spacing", "pixel_size", "pixelSize")
_UNITS = ("units", "unit")
_IN_UM = "element_size_um"
ATTRIBUTES = (_IN_UM, *_SIZES, *_UNITS)


def stated_spacings(
    attributes: Mapping[str, Any], axes: Sequence[str]
) -> Iterator[tuple[str, Triple]]:
    """Yield each attribute that states the spacing, and its value (z, y, x), um.

    axes  names of the array's axes, as stored; sizes are along all axes or the three of space
    """
    if len(sizes := _numbers(attributes.get(_IN_UM))) == 3:
        yield _IN_UM, (sizes[0], sizes[1], sizes[2])
    unit = next((u for u in map(attributes.get, _UNITS) if u is not None), None)
    for name in _SIZES:
        sizes = _numbers(attributes.get(name))
        if sizes and (found := spacing_of(sizes, unit, axes)) is not None:
            yield name, found


def spacing_of(sizes: Sequence[float], unit: Any, axes: Sequence[str]) -> Triple | None:
    """Return (z, y, x), um, from sizes along all axes or the three of space; None: neither fits.

    unit  one text for all sizes, or one for each
    """
    along = [axis for axis in axes if axis in "zyx"] if len(sizes) == 3 else list(axes)
    every = text_of(unit)
    units = [every] * len(sizes) if every else list(np.atleast_1d(unit))
    if len(along) != len(sizes) or len(units) != len(sizes):
        return None
    um = {a: (s, um_per(text_of(u))) for a, s, u in zip(along, sizes, units, strict=True)}
    found = [size * per for size, per in (um[axis] for axis in "zyx") if per is not None]
    return (found[0], found[1], found[2]) if len(found) == 3 else None


def _numbers(value: Any) -> list[float]:
    return numbers_of(np.ravel(value)) if value is not None else []
