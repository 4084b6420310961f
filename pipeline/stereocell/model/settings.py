"""Settings declared once: a dataclass field with its default, its comment and its flag."""

from dataclasses import dataclass, field, fields
from typing import Any

from stereocell.model.errors import UsageError

AUTO = "auto"
MAX_LENGTH_UM = 1e12  # um: float32 and browsers still draw places so far from the origin
MAX_COUNT = 2**53  # whole numbers up to here stay whole in JSON and in float64
EIGHT_BITS = 8  # of a voxel in the stage; with more, the voxels as measured are kept as well
MAX_VOXEL_VALUE = 1e30  # squares and differences of larger ones overflow float32


@dataclass(frozen=True, slots=True)
class Flag:
    """How a setting is given to a command.

    name  as `--tile-size`
    help  what `--help` says of it; empty: the setting's comment
    form  what its text looks like, where its type does not tell: `z,y,x`, `CHANNEL=VALUE`
    """

    name: str
    help: str = ""
    form: str = ""


@dataclass(frozen=True, slots=True)
class Bounds:
    """The least and the largest value of a number, or of each number of a list."""

    least: float
    most: float


LENGTH_UM = Bounds(0, MAX_LENGTH_UM)
COUNT = Bounds(1, MAX_COUNT)
COUNT_OR_NONE = Bounds(0, MAX_COUNT)
WHOLE_NUMBER = Bounds(-MAX_COUNT, MAX_COUNT)


def setting(
    default: Any, comment: str, *, flag: Flag | None = None, bounds: Bounds | None = None
) -> Any:
    """Return a dataclass field: its default and comment become a line of `stereocell.toml`.

    bounds  of a number: every setting that may be one has them
    """
    metadata = {"comment": comment, "flag": flag, "bounds": bounds}
    if isinstance(default, dict):
        return field(default_factory=default.copy, metadata=metadata)
    return field(default=default, metadata=metadata)


def require_bounds(section: str, options: Any) -> None:
    """Raise UsageError for the first number of a section of settings beyond its bounds."""
    for one in fields(options):
        bounds, given = one.metadata["bounds"], getattr(options, one.name)
        if bounds is None:
            continue
        for value in given if isinstance(given, tuple) else (given,):
            if not isinstance(value, str) and not bounds.least <= value <= bounds.most:
                raise UsageError(f"{section}.{one.name} is {value}, expected {_words(bounds)}")


def _words(bounds: Bounds) -> str:
    if bounds == LENGTH_UM:
        return f"a length in um, 0 to {bounds.most:g}"
    if bounds == WHOLE_NUMBER:
        return "a whole number from -2^53 to 2^53"
    if bounds.most == MAX_COUNT:
        return f"{bounds.least:g} or more, at most 2^53"
    return f"{bounds.least:g} to {bounds.most:g}"


def length_um(where: str, value: float | str, auto: float) -> float:
    """Return a setting that is a length in um, or `auto` where it is left open. UsageError."""
    if value == AUTO:
        return auto
    if isinstance(value, str) or not value >= 0:
        raise UsageError(f"{where} is {value!r}, expected a length in um or {AUTO!r}")
    return value
