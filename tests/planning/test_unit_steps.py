"""The order in which units are built."""

import math
from types import SimpleNamespace
from typing import Any, cast

from stereocell.planning.plan import Plan
from stereocell.planning.survey import Survey
from stereocell.planning.unit_steps import longest_first


def _end_s(seconds: list[float], workers: int) -> float:
    """Return when the last of several workers ends that each take the next task."""
    busy = [0.0] * workers
    for one in seconds:
        busy[busy.index(min(busy))] += one
    return max(busy)


def test_units_of_a_tile_are_built_by_falling_work_so_that_workers_end_together() -> None:
    faces = {"small": 1, "medium": 2, "large": 4, "little": 1}
    plan = cast(Plan, SimpleNamespace(tiles=[SimpleNamespace(id=id_) for id_ in ("b", "a")]))
    survey = cast(
        Survey, {name: cast(Any, SimpleNamespace(most_faces=n)) for name, n in faces.items()}
    )
    names = [f"{tile}/{channel}" for tile in ("b", "a") for channel in (*faces, "cells")]
    ordered = longest_first(plan, survey, reversed(names))
    assert sorted(ordered) == sorted(names)
    assert [name[0] for name in ordered] == ["b"] * 5 + ["a"] * 5  # a tile is whole before the next
    own = [name[2:] for name in ordered if name.startswith("a/")]
    work = [faces.get(name, math.inf) for name in own]
    assert work == sorted(work, reverse=True)
    assert own[0] == "cells"  # a label map, whose work is not known
    assert _end_s(work[1:], 2) == 4 < _end_s([faces[name] for name in faces], 2)
