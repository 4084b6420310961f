"""Convert numbers that a file states to floats. JSON and attributes hold integers of any length."""

import math
from collections.abc import Iterable
from typing import Any


def number_of(value: Any) -> float:
    """Return a stated number; infinity where it is too large for a float.

    Raises ValueError or TypeError where it is not a number.
    """
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def numbers_of(values: Iterable[Any] | None) -> list[float]:
    """Return stated numbers as floats; empty: none are stated, or one value is not a number."""
    try:
        return [number_of(value) for value in (() if values is None else values)]
    except (TypeError, ValueError):
        return []
