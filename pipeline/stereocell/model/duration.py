"""Write durations as text."""

from itertools import pairwise

_UNITS = ((86_400, "d"), (3600, "h"), (60, "min"), (1, "s"))  # seconds


def in_words(seconds: float) -> str:
    """Return a duration in at most two units, rounded.

    >>> in_words(40), in_words(200), in_words(7500)
    ('40 s', '3 min 20 s', '2 h 5 min')
    """
    whole = round(seconds)
    for (size, unit), (least, smaller) in pairwise(_UNITS):
        if whole >= size:
            count, rest = divmod(round(whole / least), size // least)
            return f"{count} {unit} {rest} {smaller}" if rest else f"{count} {unit}"
    return f"{whole} s"
