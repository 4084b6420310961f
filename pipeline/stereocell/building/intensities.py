"""Hold a source's channels to be intensities: of a label map no iso-surface is meant.

The metadata go before the voxels: an image that is said to be of labels is one.

Cameras don't count with 4 bytes and programs that number objects do. So of wide integers a block
that holds one or two values, which tells nothing else, is taken for a part of a label map.
"""

from collections.abc import Iterator, Sequence
from itertools import product

from stereocell.model.errors import UsageError
from stereocell.model.tiling import Box
from stereocell.objects.label_rule import LabelEvidence, recognise
from stereocell.read import Dataset

_SIDE = 128  # voxels: largest edge of the block that is looked at
_WIDE = 4  # bytes
_MOST = 4  # channels that are looked at: a label map comes alone, or with few others


def require_intensities(dataset: Dataset, channels: Sequence[int], region: Box, level: int) -> None:
    """Raise UsageError where a channel looks like a label map.

    A block of the first channels is read at full resolution: that in the middle of what is built,
    or, where it has one value alone, the next one that has more.

    region  voxels of the level that is built
    """
    if dataset.labels:
        raise UsageError(
            f"{dataset.shown}: is a label map: found {dataset.labels}, expected intensities: "
            "objects can't be built yet; --as intensity takes it for an image, as suits the mask "
            "of one object"
        )
    stored = dataset.stored_dtype
    if stored.kind not in "iu":
        return
    (z0, y0, x0), (z1, y1, x1) = (
        [place * n // m for place, n, m in zip(places, fine, coarse, strict=True)]
        for fine, coarse in [(dataset.levels[0].shape, dataset.levels[level].shape)]
        for places in (region.start, region.stop)
    )
    finest = Box((z0, y0, x0), (z1, y1, x1))
    for index in channels[:_MOST]:
        for box in _blocks(finest):
            voxels = dataset.read_stored(index, box)
            if voxels.min() < voxels.max():
                break
        found = recognise(voxels)
        if found.kind == "labels":
            raise UsageError(_told(dataset, index, found))
        if stored.itemsize >= _WIDE and voxels.min() >= 0 and found.values <= 1:
            raise UsageError(
                f"{dataset.shown}: channel {dataset.channels[index].name!r} may be a label map: "
                f"found {stored.name} and {found.values or 'no'} value besides 0 in one block, "
                "expected intensities: objects can't be built yet; --as intensity takes it for an "
                "image"
            )


def _blocks(region: Box) -> Iterator[Box]:
    """Yield blocks of the region: its middle, then the middles of its eight octants."""
    for z, y, x in ((2, 2, 2), *product((1, 3), repeat=3)):
        sides = []
        for start, n, quarters in zip(region.start, region.shape, (z, y, x), strict=True):
            side = min(n, _SIDE)
            low = start + min(max(n * quarters // 4 - side // 2, 0), n - side)
            sides.append((low, low + side))
        (z0, z1), (y0, y1), (x0, x1) = sides
        yield Box((z0, y0, x0), (z1, y1, x1))


def _told(dataset: Dataset, index: int, found: LabelEvidence) -> str:
    return (
        f"{dataset.shown}: channel {dataset.channels[index].name!r} looks like a label map: found "
        f"{found.values} values in {found.pieces} pieces of equal voxels in one block, expected "
        "intensities: objects can't be built yet; --as intensity takes it for an image"
    )
