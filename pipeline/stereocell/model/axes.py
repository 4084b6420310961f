"""Names of an array's axes: t, c, z, y and x."""

AXES = "tczyx"


def is_axes(text: str) -> bool:
    """Whether a text names axes as `--axes` does: z, y and x, perhaps t and c, each once."""
    return set("zyx") <= set(text) <= set(AXES) and len(set(text)) == len(text)
