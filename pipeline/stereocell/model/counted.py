"""Counts in words."""


def counted(count: int, noun: str, plural: str = "") -> str:
    """Return `1 tile`, `2 tiles`, `1,200 tiles`; `plural` where an s alone won't do."""
    return f"{count:,} {noun if count == 1 else plural or noun + 's'}"


def agreeing(count: int, one: str, several: str) -> str:
    """Return the words that agree with a count: `agreeing(n, "is", "are")`."""
    return one if count == 1 else several
