"""Write counts with the right form of their noun or verb."""


def counted(count: int, noun: str, plural: str = "") -> str:
    """Return a count with its noun.

    plural  plural of the noun; empty: the noun and an s

    >>> counted(1, "tile"), counted(1200, "tile"), counted(2, "box", "boxes")
    ('1 tile', '1,200 tiles', '2 boxes')
    """
    return f"{count:,} {noun if count == 1 else plural or noun + 's'}"


def agreeing(count: int, one: str, several: str) -> str:
    """Return the words that agree with a count.

    >>> agreeing(1, "is", "are"), agreeing(2, "is", "are")
    ('is', 'are')
    """
    return one if count == 1 else several
