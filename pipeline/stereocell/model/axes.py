"""Names of an array's axes: t, c, z, y and x."""

AXES = "tczyx"


def axes_of(text: str) -> str:
    """Return the letters of a text of `--axes`, as ImageJ's users may type it.

    >>> axes_of("Z, C, Y, X")
    'zcyx'
    """
    return text.lower().replace(",", "").replace(" ", "")


def is_axes(letters: str) -> bool:
    """Whether letters name axes as `--axes` does: z, y and x, perhaps t and c, each once."""
    is_known = set("zyx") <= set(letters) <= set(AXES)
    return is_known and len(set(letters)) == len(letters)
