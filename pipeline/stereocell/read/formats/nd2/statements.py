"""Compare the statements on the voxel spacing in an ND2 file.

The Z loop states the step, and also the lowest and the highest position. They disagree by less than
a step if a user typed a range that is not a multiple of the step. They disagree by more if the
program that wrote the file set only one of them.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from stereocell.read.spacing import PartialTriple
from stereocell.read.statements import Statement, Subject, Trust, settle

_LOOPS = "ImageMetadataLV"  # chunk of the file that holds the loops
_REMEDY = "--spacing-um z,y,x replaces it"


def settle_spacing(nd2: Any, sizes: Mapping[str, int]) -> tuple[PartialTriple, tuple[str, ...]]:
    """Return the spacing (z, y, x), um, and notes. None: not stated, where nd2 itself returns 1.

    nd2    open file of the library nd2
    sizes  number of frames or voxels along each axis
    """
    size, volume = nd2.voxel_size(), volume_of(nd2)
    is_stated = (True, True, True) if volume is None else volume.axesCalibrated
    x, y, z = (
        float(value) if known and value > 0 else None
        for value, known in zip((size.x, size.y, size.z), is_stated, strict=True)
    )
    steps = sizes.get("Z", 1) - 1
    if z is None or steps < 1:
        return (z if "Z" in sizes else None, y, x), ()
    statements = [Statement(z, "dZStep of the Z loop")]
    for low, high in _ranges(nd2):
        step = abs(high - low) / steps
        statements.append(Statement(step, "its range from dZLow to dZHigh", Trust.REPEATED))
    subject = Subject("voxel spacing along z", "um", 1 / steps, _REMEDY)
    settled = settle(subject, statements)
    return (settled.number, y, x), settled.notes


def volume_of(nd2: Any) -> Any:
    """Return the library's description of the axes; None: the file has none."""
    channels = getattr(nd2.metadata, "channels", None) or [None]
    return getattr(channels[0], "volume", None)


def _ranges(nd2: Any) -> Iterator[tuple[float, float]]:
    """Yield the lowest and the highest position, um, of each Z loop that states both."""
    if nd2.is_legacy:
        return
    waiting = [nd2.unstructured_metadata(include={_LOOPS}, strip_prefix=False)]
    while waiting:
        values = waiting.pop()
        low, high = values.get("dZLow"), values.get("dZHigh")
        if isinstance(low, float) and isinstance(high, float) and low != high:
            yield low, high
        waiting += [one for one in values.values() if isinstance(one, Mapping)]
