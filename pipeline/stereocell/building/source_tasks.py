"""Tasks that read a plan's source: how they run, and the source's part of their results' keys."""

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from stereocell.building.channels import Channel
from stereocell.building.input_unchanged import require_added, require_input, require_labels
from stereocell.building.plan import Plan
from stereocell.engine.run import Engine
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box
from stereocell.read.readers import reader_of

T = TypeVar("T")
R = TypeVar("R")


def run_on_input(
    plan: Plan,
    engine: Engine,
    label: str,
    function: Callable[[T], R],
    tasks: Sequence[tuple[str, T]],
) -> list[R]:
    """Run tasks that read the source. Raises SourceError where it changed since the plan."""
    if not tasks:
        return []
    require_input(plan)
    require_added(plan)
    require_labels(plan)
    return engine.run(label, function, tasks)


def around(field: LatticeField | None, box: Box) -> LatticeField | None:
    """Return the knots of a field near a box; None where there is no field."""
    return None if field is None else field.around(box)


def input_key(plan: Plan, channel: Channel) -> list[Any]:
    """Return the source's part of the key of a channel's result."""
    if channel.source:
        return [channel.fingerprint, 0, plan.spacing_um, plan.origin_um, 0]
    return [plan.fingerprint, plan.level, plan.spacing_um, plan.origin_um, plan.settings.plan.time]


def reader_module(plan: Plan, channel: Channel) -> str:
    """Return the module that reads a channel: other formats' readers don't affect its results."""
    return reader_of(channel.source or plan.source)


def box_to_json(box: Box) -> list[list[int]]:
    """Return a box as [start, stop], voxels (z, y, x)."""
    return [list(box.start), list(box.stop)]
