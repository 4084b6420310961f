"""Settings declared once: a frozen dataclass field with its default and the comment users read."""

from dataclasses import field
from typing import Any

from stereocell.model.errors import UsageError

AUTO = "auto"


def setting(default: Any, comment: str) -> Any:
    """Return a dataclass field whose default and comment become lines of `stereocell.toml`."""
    return field(default=default, metadata={"comment": comment})


def length_um(where: str, value: float | str, auto: float) -> float:
    """Return a setting that is a length in um, or `auto` where it is left open. UsageError."""
    if value == AUTO:
        return auto
    if isinstance(value, str) or not value >= 0:
        raise UsageError(f"{where} is {value!r}, expected a length in um or {AUTO!r}")
    return value
