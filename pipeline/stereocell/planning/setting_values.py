"""Check the plain values of settings before they are converted to their types."""

from collections.abc import Mapping
from math import isfinite
from typing import Any

from stereocell.model.errors import UsageError
from stereocell.model.utf8 import escaped_bytes


def finite(value: Any) -> Any:
    """Return plain values with None in place of numbers that are not finite."""
    if isinstance(value, Mapping):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, int | float):
        try:
            return value if isfinite(value) else None
        except OverflowError:  # whole numbers in TOML may be larger than any float
            return None
    return [finite(inner) for inner in value] if isinstance(value, list | tuple) else value


def require_utf8(values: Mapping[str, Any], where: str) -> None:
    """Raise UsageError if a key or text in {section: {key: value}} is not UTF-8.

    where  name of the file or command line, for messages
    """
    for section, content in values.items():
        for key, value in content.items():
            listed = value if isinstance(value, list | tuple) else [value]
            for text in (key, *listed):
                if isinstance(text, str) and (shown := escaped_bytes(text)):
                    name = f"{section}.{escaped_bytes(key) or key}"
                    raise UsageError(f"{where}: {name} is '{shown}', expected text in UTF-8")
