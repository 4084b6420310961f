"""Hold a source's channels to be intensities: of a label map no iso-surface is meant.

The metadata go before the voxels: an image that is said to be of labels is one.

Cameras don't count with 4 bytes and programs that number objects do. So of wide integers a block
that holds one or two values, which tells nothing else, is taken for a part of a label map.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import UsageError
from stereocell.model.tiling import Box
from stereocell.objects.label_rule import Kind, recognise
from stereocell.read import Dataset
from stereocell.steps.labels import Labels

_SIDE = 128  # voxels: largest edge of a block that is looked at
_MIN_SIDE = 32  # voxels: smallest edge of a block, however many channels are looked at
_WIDE = 4  # bytes
_MAX_EXACT = 2.0**53  # whole numbers below are exact as float64
_FEW_VALUES = 8  # fewer tell nothing
_IMAGE_S_PIECE = 7.5  # voxels of equal values in images (objects/label_rule.py), at most
_MAX_CHANNELS = 4  # looked at in blocks of _SIDE; most label maps come with fewer others


def require_intensities(dataset: Dataset, channels: Sequence[int], region: Box, level: int) -> None:
    """Raise UsageError where a channel looks like a label map.

    Blocks of every channel are read at full resolution, from the middle of what is built on, until
    one has three values: two tell nothing. The more channels, the smaller the blocks.

    region  voxels of the level that is built
    """
    if dataset.labels:
        raise UsageError(
            f"{dataset.shown}: is a label map: found {dataset.labels}, expected intensities: "
            "--labels . builds its objects; --as intensity takes it for an image, as suits the "
            "mask of one object"
        )
    stored = dataset.stored_dtype
    (z0, y0, x0), (z1, y1, x1) = (
        [place * n // m for place, n, m in zip(places, fine, coarse, strict=True)]
        for fine, coarse in [(dataset.levels[0].shape, dataset.levels[level].shape)]
        for places in (region.start, region.stop)
    )
    finest = Box((z0, y0, x0), (z1, y1, x1))
    share = _MAX_CHANNELS / max(1, len(channels))
    side = max(_MIN_SIDE, min(_SIDE, round(_SIDE * share ** (1 / 3))))
    for index in channels:
        found = _look_at(dataset, index, finest, side)
        if found.kind == "labels":
            raise UsageError(_describe(dataset, index, found))
        if stored.kind in "iu" and stored.itemsize >= _WIDE and found.is_plain:
            raise UsageError(
                f"{dataset.shown}: channel {dataset.channels[index].name!r} may be a label map: "
                f"found {stored.name} and {found.values or 'no'} value besides 0, "
                "expected intensities: --labels . builds its objects; --as intensity takes it for "
                "an image"
            )


def doubt_of(labels: Labels) -> str:
    """Return what is said of a label map whose middle looks like an image; empty: it does not.

    Raises SourceError.
    """
    box = next(_blocks(Box((0, 0, 0), labels.shape), _SIDE))
    voxels = labels.open().read(box)
    found = recognise(voxels)
    if found.kind != "image" or found.values <= _FEW_VALUES:
        return ""
    if found.pieces and np.count_nonzero(voxels) > _IMAGE_S_PIECE * found.pieces:
        return ""
    return (
        f"{labels.name}: looks like intensities: {found.values} values that differ from voxel to "
        "voxel; each of them is taken for an object's number"
    )


@dataclass(frozen=True, slots=True)
class _Found:
    """What the blocks of a channel hold; `is_plain`: one or two values, none of them negative."""

    kind: Kind
    values: int
    pieces: int
    is_plain: bool


def _look_at(dataset: Dataset, index: int, finest: Box, side: int) -> _Found:
    """Return what the first block with three values or more holds; where none has, all blocks.

    Blocks with one object each have two values each, and are a label map where these differ.
    """
    values: set[int] = set()
    is_plain = True
    for box in _blocks(finest, side):
        voxels = _whole_numbers(dataset.read_stored(index, box))
        if voxels is None:
            return _Found("image", 0, 0, is_plain=False)
        found = recognise(voxels)
        own = np.unique(voxels)
        if len(own) > 2:
            return _Found(found.kind, found.values, found.pieces, is_plain=False)
        is_plain &= bool(own[0] >= 0)
        values.update(int(value) for value in own)
    kind: Kind = "labels" if len(values) > 2 and is_plain else "mask"
    objects = len(values - {0})
    return _Found(kind, objects, objects, is_plain=is_plain and len(values) <= 2)


def _whole_numbers(voxels: NDArray[Any]) -> NDArray[Any] | None:
    """Return the voxels as integers: programs save labels as floats too. None: some are no labels.

    voxels  (z, y, x), as stored; NaN is no object
    """
    if voxels.dtype.kind in "iu":
        return voxels
    if voxels.dtype.kind != "f":
        return None
    voxels = np.where(np.isnan(voxels), 0, voxels)
    if not np.isfinite(voxels).all() or (voxels % 1 != 0).any():
        return None
    return voxels.astype(np.int64) if np.abs(voxels).max() < _MAX_EXACT else None


def _blocks(region: Box, most: int) -> Iterator[Box]:
    """Yield blocks of the region: its middle, then the middles of its eight octants.

    most  voxels of a block's edge
    """
    for z, y, x in ((2, 2, 2), *product((1, 3), repeat=3)):
        sides = []
        for start, n, quarters in zip(region.start, region.shape, (z, y, x), strict=True):
            side = min(n, most)
            low = start + min(max(n * quarters // 4 - side // 2, 0), n - side)
            sides.append((low, low + side))
        (z0, z1), (y0, y1), (x0, x1) = sides
        yield Box((z0, y0, x0), (z1, y1, x1))


def _describe(dataset: Dataset, index: int, found: _Found) -> str:
    return (
        f"{dataset.shown}: channel {dataset.channels[index].name!r} looks like a label map of "
        f"{found.values} objects: found {found.pieces} pieces of equal voxels, expected "
        "intensities: --labels . builds its objects; --as intensity takes it for an image"
    )
