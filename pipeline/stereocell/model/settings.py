"""Declare a setting once, as a dataclass field with its default, comment, flag and bounds."""

from dataclasses import dataclass, field, fields
from typing import Any

from stereocell.model.errors import UsageError

AUTO = "auto"
MAX_LENGTH_UM = 1e12  # um; float32 and browsers can draw positions so far from the origin
MAX_COUNT = 2**53  # JSON and float64 hold whole numbers up to this exactly
EIGHT_BITS = 8  # bits of a voxel in the stage; with more, the voxels as measured are kept, too
MAX_VOXEL_VALUE = 1e30  # squares and differences of larger values overflow float32


@dataclass(frozen=True, slots=True)
class Flag:
    """The flag by which a setting is given to a command.

    name  name of the flag, such as `--tile-size`
    help  text of `--help`; empty: the setting's comment
    form  form of its value, if its type does not show it: `z,y,x`, `CHANNEL=VALUE`
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
    """Return a dataclass field. Its default and comment become a line of `stereocell.toml`.

    bounds  bounds of a number; every setting that may be a number has them
    """
    metadata = {"comment": comment, "flag": flag, "bounds": bounds}
    if isinstance(default, dict):
        return field(default_factory=default.copy, metadata=metadata)
    return field(default=default, metadata=metadata)


def require_bounds(section: str, options: Any) -> None:
    """Raise UsageError for the first number in a section of settings that exceeds its bounds."""
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
    """Return a setting that is a length in um, or `auto` if the setting is "auto".

    where  name of the setting, for messages

    Raises UsageError for any other value.
    """
    if value == AUTO:
        return auto
    if isinstance(value, str) or not value >= 0:
        raise UsageError(f"{where} is {value!r}, expected a length in um or {AUTO!r}")
    return value
