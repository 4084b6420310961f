"""Remove the unit that follows the number in each cell of a column, such as `12.5 %`."""

import re
from collections import Counter
from collections.abc import Sequence

from stereocell.read.spacing import um_per
from stereocell.read.tables.table import MISSING

_WITH_UNIT = re.compile(
    r"([+\u2212-]?[0-9][0-9.,'\u2019\u00a0\u202f]*(?:[eE][+-]?[0-9]+)?)\s*"
    r"(%|\u2030|\u00b0[CF]?|[^\W\d_][^\s0-9]{0,9}[0-9\u00b2\u00b3]?)"
)
_MOST_OTHERS = 0.25  # share of the filled cells that may hold words, or numbers without the unit
_SHOWN = 4  # units that a note lists


def without_unit(name: str, texts: Sequence[str]) -> tuple[Sequence[str], str]:
    """Return a column's cells without the unit that follows their numbers, and a note.

    Cells with several units of length or of shares are not changed, and the note says so.
    """
    if not any(text[:1].isdecimal() and not text[-1:].isdecimal() for text in texts):
        return texts, ""
    cells = [text.strip() for text in texts]
    matches = [_WITH_UNIT.fullmatch(cell) for cell in cells]
    units = Counter(match[2] for match in matches if match)
    filled = sum(cell.lower() not in MISSING for cell in cells)
    if not units or units.total() < (1 - _MOST_OTHERS) * filled:
        return texts, ""
    if len(units) > 1:
        listed = ", ".join(repr(unit) for unit in list(units)[:_SHOWN])
        are_units = all(unit == "%" or um_per(unit) is not None for unit in units)
        note = f"column {name!r:.60}: the numbers have several units ({listed}): read as texts"
        return texts, note if are_units else ""
    bare = [match[1] if match else cell for cell, match in zip(cells, matches, strict=True)]
    return (
        bare,
        f"column {name!r:.60}: the unit {next(iter(units))!r} after the numbers is left out",
    )
