"""Compare the statements on the voxel spacing in `/DataSetInfo/Image` of an Imaris file.

Imaris divides the extents by the size. The microscope's own spacing is in `RecordingEntry...`, in
um. It differs if a user has corrected the extents, or if a converter has set only one of them.
"""

from collections.abc import Callable, Sequence

from stereocell.read.spacing import Triple, um_per
from stereocell.read.statements import Statement, Subject, Trust, settle

_RECORDED = {
    "z": "RecordingEntryPlaneSpacing",
    "y": "RecordingEntryLineSpacing",
    "x": "RecordingEntrySampleSpacing",
}
_INDEX = {"z": 2, "y": 1, "x": 0}  # number of each axis in ExtMin and ExtMax
_SIZE = Subject("size of the image (ImageSizeZ, ImageSizeY, ImageSizeX)", "voxels")
_UNIT = Subject("unit of length", remedy="--spacing-um z,y,x replaces the spacing")


def settle_lengths(
    number: Callable[[str], float | None], unit: object, shape: Sequence[int]
) -> tuple[Triple | None, tuple[str, ...]]:
    """Return the lengths (z, y, x) of the volume, um, and notes; None: they are not stated.

    number  returns a number from an attribute of `/DataSetInfo/Image`; None: it is absent
    unit    value of the attribute Unit; None: it is absent
    shape   voxels (z, y, x)
    """
    notes: list[str] = []
    if unit is None:
        assumed = settle(_UNIT, [Statement("um", "as in files of Imaris", Trust.ASSUMED)])
        unit, notes = str(assumed.value), list(assumed.notes)
    per = um_per(unit)
    found, lengths = [], []
    for axis, size in zip("zyx", shape, strict=True):
        low, high = (number(f"{name}{_INDEX[axis]}") for name in ("ExtMin", "ExtMax"))
        length = None if low is None or high is None or per is None else (high - low) * per
        if not (statements := _along(number, axis, size, length)):
            return None, ()
        subject = Subject(
            f"voxel spacing along {axis}", "um", remedy="--spacing-um z,y,x replaces it"
        )
        settled = settle(subject, statements)
        found.append(settled.number)
        lengths.append(settled.number * size if length is None else length)
        notes += settled.notes
    if all(spacing == per for spacing in found):
        notes.append(
            f"voxel spacing: found exactly 1 {unit} along all axes, which Imaris writes if it "
            "knows no spacing: is it correct? (--spacing-um z,y,x replaces it)"
        )
    z, y, x = lengths
    return (z, y, x), tuple(notes)


def size_notes(stated: Sequence[float | None], shape: Sequence[int]) -> tuple[str, ...]:
    """Return a note if the size without padding is not stated.

    stated  voxels (z, y, x) of the finest level; None for each one not stated
    shape   voxels that are read
    """
    if None not in stated:
        return ()
    place = "the size of the dataset with its padding"
    taken = Statement(tuple(map(float, shape)), place, Trust.ASSUMED)
    return settle(_SIZE, [taken]).notes


def _along(
    number: Callable[[str], float | None], axis: str, size: int, length: float | None
) -> list[Statement]:
    """Return the statements on the spacing along an axis, um. `length` is from the extents."""
    stated, recorded = number(axis.upper()), number(_RECORDED[axis])
    statements = []
    if length is not None:
        statements.append(Statement(length / size, f"the extent by {size} voxels"))
        if stated is not None and stated >= 1:
            place = f"the extent by {axis.upper()} {stated:g} of DataSetInfo"
            statements.append(Statement(length / stated, place, Trust.REPEATED))
    if recorded is not None and recorded > 0:
        statements.append(Statement(recorded, _RECORDED[axis], Trust.REPEATED))
    return statements
