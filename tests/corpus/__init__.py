"""The corpus: volumes with a known truth, and empty volumes.

A truth is drawn by a person, follows from physics, or is made by a script. The corpus is used to
choose and to check the method that finds iso-values. Some cases are held out: no constant is chosen
on them.
"""

from collections.abc import Iterator

from corpus.case import Case
from corpus.made import empty_cases, family_cases, made_cases, nested_cases
from corpus.real import real_cases


def all_cases() -> Iterator[Case]:
    """Yield every case; real volumes only if STEREOCELL_DATA names their folder."""
    yield from real_cases()
    yield from made_cases()
    yield from family_cases()
    yield from nested_cases()
    yield from empty_cases()
