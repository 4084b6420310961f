"""The tag Orientation: the position of the first row and column of the stored pixels.

libtiff turns the pixels by it when it draws an image. Readers of OME-TIFF ignore the tag, and so
does this one for OME-TIFF, with a note.

References: TIFF 6.0, tag 274
"""

from typing import Any

from numpy.typing import NDArray
from tifffile import TiffPage

from stereocell.read.turn import Turn

_SWAPPED = (0, 2, 1)
# Orientation -> turn. Stored rows of 5 to 8 are columns of the image.
_TURNS = {
    2: Turn(flips=(False, False, True)),
    3: Turn(flips=(False, True, True)),
    4: Turn(flips=(False, True, False)),
    5: Turn(_SWAPPED),
    6: Turn(_SWAPPED, (False, False, True)),
    7: Turn(_SWAPPED, (False, True, True)),
    8: Turn(_SWAPPED, (False, True, False)),
}
_SIDES = {
    2: ("top", "right"), 3: ("bottom", "right"), 4: ("bottom", "left"), 5: ("left", "top"),
    6: ("right", "top"), 7: ("right", "bottom"), 8: ("left", "bottom"),
}  # fmt: skip


def turn_of(page: TiffPage, *, is_applied: bool = True) -> tuple[Turn, tuple[str, ...]]:
    """Return the turn that a page's tag states, and a note.

    is_applied  False: the pixels stay as stored, and the note says so
    """
    return turn_by(page.tags.valueof("Orientation", default=1), is_applied=is_applied)


def turned_pixels(pixels: NDArray[Any], turn: Turn) -> NDArray[Any]:
    """Return the pixels (rows, columns, ...) of one plane after a turn."""
    seen = pixels.swapaxes(0, 1) if turn.order == _SWAPPED else pixels
    _, y, x = (slice(None, None, -1 if flip else 1) for flip in turn.flips)
    return seen[y, x]


def turn_by(value: Any, *, is_applied: bool = True) -> tuple[Turn, tuple[str, ...]]:
    """Return the turn for a value of the tag, which EXIF has too, and a note."""
    if value not in _TURNS:
        return Turn(), ()
    row, column = _SIDES[value]
    made = "the planes are turned by it" if is_applied else "not applied, as usual for OME-TIFF"
    note = (
        f"Orientation {value}: the first row is the {row} of the image, the first column its "
        f"{column}: {made}"
    )
    return (_TURNS[value] if is_applied else Turn()), (note,)
