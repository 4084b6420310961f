"""Names of an array's axes: t, c, z, y and x."""

AXES = "tczyx"


def axes_of(text: str) -> str:
    """Return the letters in the value of `--axes`, which may be typed as in ImageJ.

    >>> axes_of("Z, C, Y, X")
    'zcyx'
    """
    return text.lower().replace(",", "").replace(" ", "")


def is_axes(letters: str) -> bool:
    """Return whether the letters are z, y and x, and perhaps t and c, each once."""
    is_known = set("zyx") <= set(letters) <= set(AXES)
    return is_known and len(set(letters)) == len(letters)
