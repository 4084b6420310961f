"""Hold a source's channels to be intensities: of a label map no iso-surface is meant.

The metadata go before the voxels: an image that is said to be of labels is one.

Cameras don't count with 4 bytes and programs that number objects do. So of wide integers a block
that holds one or two values, which tells nothing else, is taken for a part of a label map.
"""

from collections.abc import Sequence

from stereocell.model.errors import UsageError
from stereocell.model.tiling import Box
from stereocell.objects.label_rule import LabelEvidence, recognise
from stereocell.read import Dataset

_SIDE = 128  # voxels: largest edge of the block that is looked at
_WIDE = 4  # bytes
_MOST = 4  # channels that are looked at: a label map comes alone, or with few others


def require_intensities(dataset: Dataset, channels: Sequence[int]) -> None:
    """Raise UsageError where a channel looks like a label map.

    A block in the middle of the first channels is read, at full resolution.
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
    sides = [((n - min(n, _SIDE)) // 2, (n + min(n, _SIDE)) // 2) for n in dataset.levels[0].shape]
    start, stop = zip(*sides, strict=True)
    for index in channels[:_MOST]:
        voxels = dataset.read_stored(index, Box(start, stop))
        found = recognise(voxels)
        if found.kind == "labels":
            raise UsageError(_told(dataset, index, found))
        if stored.itemsize >= _WIDE and voxels.min() >= 0 and found.values <= 1:
            raise UsageError(
                f"{dataset.shown}: channel {dataset.channels[index].name!r} may be a label map: "
                f"found {stored.name} and {found.values} values besides 0 in the middle, expected "
                "intensities: objects can't be built yet; --as intensity takes it for an image"
            )


def _told(dataset: Dataset, index: int, found: LabelEvidence) -> str:
    return (
        f"{dataset.shown}: channel {dataset.channels[index].name!r} looks like a label map: found "
        f"{found.values} values in {found.pieces} pieces of equal voxels in the middle, expected "
        "intensities: objects can't be built yet; --as intensity takes it for an image"
    )
