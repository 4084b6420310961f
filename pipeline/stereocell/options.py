"""Settings declared once: a frozen dataclass field with its default and the comment users read."""

from dataclasses import field
from typing import Any


def setting(default: Any, comment: str) -> Any:
    """Return a dataclass field whose default and comment become lines of `stereocell.toml`."""
    return field(default=default, metadata={"comment": comment})
