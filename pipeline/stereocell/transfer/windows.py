"""Windows that are given by value, and those of CT that radiologists know by name."""

from stereocell.model.errors import UsageError
from stereocell.model.settings import MAX_VOXEL_VALUE

# Width and centre in Hounsfield units, as on CT consoles
NAMED = {
    "brain": (80.0, 40.0),
    "bone": (2000.0, 500.0),
    "lung": (1500.0, -600.0),
    "soft": (400.0, 40.0),
}


def parse_window(where: str, text: str) -> tuple[float, float]:
    """Return the voxel values that become 0 and 255, from `LOW:HIGH` or a name.

    Raises UsageError if the text is neither.
    """
    if text in NAMED:
        width, centre = NAMED[text]
        return centre - width / 2, centre + width / 2
    low, colon, high = text.partition(":")
    try:
        ends = float(low), float(high)
    except ValueError:
        ends = (0.0, 0.0)
    if not colon or not all(abs(end) <= MAX_VOXEL_VALUE for end in ends) or not ends[0] < ends[1]:
        raise UsageError(
            f"{where} is {text!r:.60}, expected LOW:HIGH in voxel values, such as -160:240, or one "
            f"of {', '.join(NAMED)} (CT)"
        )
    return ends
