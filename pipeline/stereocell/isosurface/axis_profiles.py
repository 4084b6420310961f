"""How much of what varies in a channel varies along the axes alone, as light does and no body.

Light that falls off with depth, a ramp, stripes and vignetting are nearly sums of a function of z,
one of y and one of x. Bodies are not: in the volumes of `make bench-iso` their means along the axes
explain at most .45 of the variance, and .86 to 1.0 in fields of nothing, and of nothing but
texture, under such light. A slab of tissue between two dark ends does vary along z alone, but up
and down; an edge of tissue along an axis does as well, but lies between two peaks (a valley of .6
and deeper in 20 such volumes; light makes none). Fields of different brightness side by side look
just as such an edge does: they are not told from one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_LIGHT = 0.85  # share of the variance, beyond which all is light
_ONE_WAY = 1.25  # way up and down along z over its range, up to which the values only rise or fall
_BLUR = 8  # planes averaged before that way is measured: noise goes up and down everywhere


@dataclass(frozen=True, slots=True)
class Profiles:
    """Sums over a tile's voxels in each plane across an axis, but for its padding.

    start   voxels (z, y, x) at which the tile begins
    sums    float64, of the values, by z, by y and by x
    counts  int64, of the voxels, likewise
    """

    start: tuple[int, int, int]
    sums: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
    counts: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]

    @classmethod
    def of(
        cls, field: NDArray[np.float32], kept: NDArray[np.bool_], start: tuple[int, int, int]
    ) -> "Profiles":
        """Return the profiles of a tile's field (z, y, x) where `kept`, bool of the same shape."""
        are_all = bool(kept.all())
        values = np.ascontiguousarray(field) if are_all else np.where(kept, field, np.float32(0))
        sz, sy, sx = (values.sum(axis=axes, dtype=np.float64) for axes in _ACROSS)
        nz, ny, nx = (
            np.full(n, kept.size // max(n, 1)) if are_all else kept.sum(axis=axes, dtype=np.int64)
            for n, axes in zip(kept.shape, _ACROSS, strict=True)
        )
        return cls(start, (sz, sy, sx), (nz, ny, nx))


_ACROSS = ((1, 2), (0, 2), (0, 1))


def share_of_light(
    tiles: Sequence[Profiles], plain: Sequence[Profiles], *, variance: float
) -> float:
    """Return the share of the variance that the means along the axes explain, 0..1.

    tiles     of the whole dataset, of the values that levels are looked for in
    plain     the same of the field as it is: a background that is subtracted waves along z
    variance  of those values without noise
    """
    if not tiles or not variance > 0:
        return 0.0
    found = 0.0
    for axis in range(3):
        means, counts = _means(tiles, axis)
        if len(means) and (axis > 0 or _is_one_way(_means(plain, axis)[0])):
            mean = np.average(means, weights=counts)
            found += float(np.average((means - mean) ** 2, weights=counts))
    return min(found / variance, 1.0)


def _means(tiles: Sequence[Profiles], axis: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean of each plane across an axis that has voxels, and their number."""
    length = max(tile.start[axis] + len(tile.sums[axis]) for tile in tiles)
    sums, counts = np.zeros(length), np.zeros(length)
    for tile in tiles:
        place = slice(tile.start[axis], tile.start[axis] + len(tile.sums[axis]))
        sums[place] += tile.sums[axis]
        counts[place] += tile.counts[axis]
    has_voxels = counts > 0
    return sums[has_voxels] / counts[has_voxels], counts[has_voxels]


def _is_one_way(means: NDArray[np.float64]) -> bool:
    width = max(1, min(_BLUR, len(means) // 4))
    smooth = np.convolve(means, np.full(width, 1 / width), mode="valid")
    return bool(np.abs(np.diff(smooth)).sum() <= _ONE_WAY * np.ptp(smooth))
