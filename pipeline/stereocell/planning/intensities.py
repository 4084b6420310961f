"""Check that a source's channels hold intensities and not labels, which have no iso-surface.

If the metadata say that the image is a label map, it is one. Otherwise blocks of voxels decide.

A block with one or two values could be either. If its integers have 4 bytes or more, it is taken
for a part of a label map: cameras have fewer bytes, and programs that number objects use as many.
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

_SIDE = 128  # voxels; largest edge of a block that is read
_MIN_SIDE = 32  # voxels; smallest edge of a block, however many channels are read
_WIDE = 4  # bytes of a voxel; wider integers than cameras deliver
_MAX_EXACT = 2.0**53  # float64 holds all whole numbers below this exactly
_FEW_VALUES = 8  # different values; an image needs more to be recognised
_IMAGE_S_PIECE = 7.5  # voxels; largest mean piece of equal values in images (objects/label_rule.py)
_MAX_CHANNELS = 4  # channels that are read in blocks of _SIDE; with more, blocks are smaller


def require_intensities(dataset: Dataset, channels: Sequence[int], region: Box, level: int) -> None:
    """Raise UsageError if a channel looks like a label map.

    Blocks of each channel are read at full resolution, from the middle of the region outwards,
    until a block has three values. Blocks are smaller if there are many channels.

    region  voxels of the level that is built
    """
    if dataset.labels:
        raise UsageError(
            f"{dataset.shown}: this is a label map: found {dataset.labels}, expected intensities: "
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


def note_on_intensities(labels: Labels) -> str:
    """Return the note on a label map whose middle looks like an image; empty: it does not.

    Raises SourceError if the label map can't be read.
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
    """The kind of voxels in the blocks of a channel.

    values    number of different values besides 0
    pieces    number of connected pieces of equal voxels
    is_plain  whether there are only one or two values, and none is negative
    """

    kind: Kind
    values: int
    pieces: int
    is_plain: bool


def _look_at(dataset: Dataset, index: int, finest: Box, side: int) -> _Found:
    """Return the kind of voxels in the first block with three or more values.

    Without such a block, all blocks together decide. If each block holds another single object,
    the channel is a label map.
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
    """Return the voxels as integers; None: some are not whole numbers, so they are not labels.

    Some programs save labels as floats.

    voxels  (z, y, x), as stored; NaN counts as 0, no object
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

    most  largest edge of a block, voxels
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
