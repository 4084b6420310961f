"""Volumes with a truth: drawn by a person, given by physics, or made; and volumes of nothing.

What levels for a surface are chosen by, and held to. A part is held out: it takes no part where a
constant is chosen.
"""

from collections.abc import Iterator

from corpus.case import Case
from corpus.made import empty_cases, family_cases, made_cases, nested_cases
from corpus.real import real_cases


def all_cases() -> Iterator[Case]:
    """Yield every case; the real ones where STEREOCELL_DATA names their folder."""
    yield from real_cases()
    yield from made_cases()
    yield from family_cases()
    yield from nested_cases()
    yield from empty_cases()
