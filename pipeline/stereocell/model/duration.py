"""Durations in words."""

from itertools import pairwise

_UNITS = ((86_400, "d"), (3600, "h"), (60, "min"), (1, "s"))  # seconds


def in_words(seconds: float) -> str:
    """Return `40 s`, `3 min 20 s`, `2 h 5 min`, `3 d 4 h`: two units, rounded."""
    whole = round(seconds)
    for (size, unit), (least, smaller) in pairwise(_UNITS):
        if whole >= size:
            count, rest = divmod(round(whole / least), size // least)
            return f"{count} {unit} {rest} {smaller}" if rest else f"{count} {unit}"
    return f"{whole} s"
