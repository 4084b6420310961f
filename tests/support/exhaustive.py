"""Sweeps: `make test-exhaustive` runs all of their cases, `make test` one case of each kind.

A test that is marked `exhaustive` runs only in `make test-exhaustive` (conftest.py).
"""

import os
from collections.abc import Collection, Iterable
from typing import Any

import pytest

IS_EXHAUSTIVE = bool(os.environ.get("STEREOCELL_EXHAUSTIVE"))


def sweep(cases: Iterable[Any], kept: Collection[Any]) -> list[Any]:
    """Return the cases of a parametrization, with all except `kept` marked `exhaustive`."""
    found = list(cases)
    if missing := [case for case in kept if case not in found]:
        raise ValueError(f"kept of a sweep, but none of its cases: {missing}")
    return [case if case in kept else _marked(case) for case in found]


def _marked(case: Any) -> Any:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.exhaustive)


def examples(most: int, few: int) -> int:
    """Return how many random cases to try: `most` in the sweep, few in `make test`."""
    return most if IS_EXHAUSTIVE else few
