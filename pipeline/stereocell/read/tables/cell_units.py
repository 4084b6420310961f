"""Units that stand in the cells of a table behind the numbers, such as `12 %` and `3.5 um`.

A column whose cells have one unit holds numbers in that unit. Cells of several units can't be
compared, so their column stays text. A letter or a word that is no known unit makes a name, such
as the well `1A`.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from stereocell.read.spacing import um_per
from stereocell.read.tables.table import MISSING

_CELL = re.compile(r"(.*?[0-9][.,]?)(\s*)([^\s0-9.,'+-]\S{0,11})")
_POWER = re.compile(r"\^?-?[23]$|[\u00b2\u00b3]$")
_SYMBOLS = ("%", "\u2030", "\u00b0")
_WORDS = (
    *("s", "sec", "ms", "min", "h", "hr", "g", "mg", "px", "pixel", "pixels", "voxel", "voxels"),
    *("deg", "degree", "degrees", "HU", "a.u.", "percent", "fl", "pl", "nl", "ul", "\u00b5l"),
)


@dataclass(frozen=True, slots=True)
class Unit:
    """The unit of a column.

    texts    the cells without it
    example  the text of a cell as it stands in the table
    rest     cells with a number and without the unit
    """

    texts: Sequence[str]
    example: str
    rest: int

    def note(self, name: str, value: float) -> str:
        """Return a sentence on the column whose cells have the unit; `value` of the example."""
        some = f"; {self.rest:,} of its cells have none" if self.rest else ""
        return (
            f"units are left out of the cells of {name!r:.60}: {self.example.strip()!r:.40} is "
            f"{value:.10g}{some}"
        )


def unit_of(name: str, texts: Sequence[str]) -> tuple[Unit | None, str]:
    """Return the unit that the cells of a column have, None: they have none; and a note.

    The note is on cells of several units, which are left as they are.
    """
    found = {text: parts for text in set(texts) if (parts := _parts(text)) is not None}
    if not found:
        return None, ""
    kinds = Counter(kind for _, kind, _ in found.values())
    if len(kinds) > 1:
        shown = ", ".join(sorted({unit for _, _, unit in found.values()})[:4])
        note = (
            f"column {name!r:.60}: its cells have several units ({shown:.60}), so they are read "
            "as texts: write all of them in one unit"
        )
        return None, note
    bare = [found[text][0] if text in found else text for text in texts]
    rest = sum(
        1
        for text in texts
        if text not in found and any(map(str.isdigit, text)) and text.strip().lower() not in MISSING
    )
    example = next(text for text in texts if text in found)
    return Unit(bare, example, rest), ""


def _parts(text: str) -> tuple[str, str, str] | None:
    """Return a cell's number, the kind of its unit and the unit; None: it has no unit."""
    match = _CELL.fullmatch(text.strip())
    if match is None:
        return None
    number, space, unit = match.groups()
    base = _POWER.sub("", unit)
    power = unit[len(base) :]
    if unit in _SYMBOLS:
        return number, unit, unit
    is_length = um_per(base) is not None
    if not is_length and base not in _WORDS:
        return None
    if len(base) == 1 and not space:
        return None
    kind = f"{um_per(base):g}" if is_length else base
    return number, f"{kind} {power}", unit
