"""Compare the values that a source states for the same thing, and describe the choice in one note.

Files state a size, an axis order, a direction, a value scale or the kind of a frame in several
fields, and the fields may disagree. A reader collects a Statement for each field, with its place in
the file. `settle` compares them and chooses the value of the most trusted one. It writes a note
where the others disagree or where no field states the value. `omission` words a note on data that
is not read. A note is one sentence for the user; no result depends on it.

`Trust` gives the order of trust: a user's own value first, then values that were measured while
images were taken, then the field that the format defines for the purpose.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

Value = float | str | tuple[float, ...] | tuple[str, ...]

_MOST_SHOWN = 4  # statements that a note lists at most


class Trust(IntEnum):
    """Where a value comes from; the most trusted origin is first.

    GIVEN     the user's flag
    MEASURED  written for each image while it was acquired, such as the position of each slice
    STATED    the field that the format's specification defines for the value
    REPEATED  another field that repeats the value, or another program's field
    DERIVED   follows from other values, such as the shapes of two levels
    ASSUMED   no field states the value, and a convention or the voxels suggest it
    """

    GIVEN = 0
    MEASURED = 1
    STATED = 2
    REPEATED = 3
    DERIVED = 4
    ASSUMED = 5


@dataclass(frozen=True, slots=True)
class Subject:
    """The thing that statements are about.

    name       noun for the note, such as `voxel spacing along z`
    unit       unit of numeric values, such as `um`; empty: none
    tolerance  relative difference up to which two numbers agree
    remedy     how the user corrects the choice, such as `--spacing-um z,y,x replaces it`
    """

    name: str
    unit: str = ""
    tolerance: float = 1e-3
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class Statement:
    """One value of a subject.

    place  where the value stands, such as `pixdim` or `PhysicalSizeZ`; for an assumed value the
           reason, such as `as in most files of this format`
    """

    value: Value
    place: str
    trust: Trust = Trust.STATED


@dataclass(frozen=True, slots=True)
class Settled:
    """The chosen value, the statement it comes from, and the note on it, if there is one."""

    chosen: Statement
    notes: tuple[str, ...] = ()

    @property
    def value(self) -> Value:
        """The chosen value."""
        return self.chosen.value

    @property
    def number(self) -> float:
        """The chosen value of a subject whose values are numbers."""
        assert isinstance(self.chosen.value, float | int)
        return float(self.chosen.value)


def settle(subject: Subject, statements: Sequence[Statement]) -> Settled:
    """Choose among the statements on one subject. At least one statement is needed.

    The most trusted statement wins; among equally trusted ones, the first. The note lists the
    statements that disagree with it, or explains an assumption.
    """
    chosen = min(statements, key=lambda one: one.trust)
    remedy = f"; {subject.remedy}" if subject.remedy else ""
    if chosen.trust is Trust.ASSUMED:
        shown = _shown(chosen.value, subject)
        text = f"{subject.name}: not stated, {shown} is assumed, {chosen.place}{remedy}"
        return Settled(chosen, (text,))
    if chosen.trust is Trust.GIVEN:
        return Settled(chosen)
    others = [
        one
        for one in statements
        if one.trust is not Trust.ASSUMED and not _agree(one.value, chosen.value, subject.tolerance)
    ]
    if not others:
        return Settled(chosen)
    listed = [
        f"{one.place} states {_shown(one.value, subject)}"
        for one in (chosen, *others)[:_MOST_SHOWN]
    ]
    more = len(others) + 1 - len(listed)
    if more > 0:
        listed.append(f"{more} more differ as well")
    text = f"{subject.name}: {', '.join(listed)}: {chosen.place} is used{remedy}"
    return Settled(chosen, (text,))


def omission(found: str, reason: str, remedy: str = "") -> str:
    """Return the note on data of a source that is not read.

    found   the data with their number, such as `5 derived images`
    reason  why they are not read, such as `they are projections of the others`
    remedy  how the user can read them; empty: not possible
    """
    return f"left out: {found}, because {reason}{f'; {remedy}' if remedy else ''}"


def _agree(one: Value, other: Value, tolerance: float) -> bool:
    if isinstance(one, str) or isinstance(other, str):
        return one == other
    ours = one if isinstance(one, tuple) else (one,)
    theirs = other if isinstance(other, tuple) else (other,)
    if len(ours) != len(theirs):
        return False
    return all(_is_close(a, b, tolerance) for a, b in zip(ours, theirs, strict=True))


def _is_close(a: object, b: object, tolerance: float) -> bool:
    if isinstance(a, float | int) and isinstance(b, float | int):
        return math.isclose(a, b, rel_tol=tolerance, abs_tol=1e-12)
    return a == b


def _shown(value: Value, subject: Subject) -> str:
    """Return a value as text, with its unit if it is a number."""
    parts = value if isinstance(value, tuple) else (value,)
    text = ", ".join(part if isinstance(part, str) else f"{part:.5g}" for part in parts)
    is_number = bool(parts) and not isinstance(parts[0], str)
    return f"{text} {subject.unit}" if subject.unit and is_number else text
