"""Settings declared once: a dataclass field with its default, its comment and its flag."""

from dataclasses import dataclass, field
from typing import Any

from stereocell.model.errors import UsageError

AUTO = "auto"


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


def setting(default: Any, comment: str, *, flag: Flag | None = None) -> Any:
    """Return a dataclass field: its default and comment become a line of `stereocell.toml`."""
    metadata = {"comment": comment, "flag": flag}
    if isinstance(default, dict):
        return field(default_factory=default.copy, metadata=metadata)
    return field(default=default, metadata=metadata)


def length_um(where: str, value: float | str, auto: float) -> float:
    """Return a setting that is a length in um, or `auto` where it is left open. UsageError."""
    if value == AUTO:
        return auto
    if isinstance(value, str) or not value >= 0:
        raise UsageError(f"{where} is {value!r}, expected a length in um or {AUTO!r}")
    return value
