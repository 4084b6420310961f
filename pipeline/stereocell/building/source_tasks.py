"""Tasks that read a plan's source: how they run, and the source's part of their results' keys."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from stereocell.building.channels import Channel
from stereocell.building.input_unchanged import (
    InputChangedError,
    require_added,
    require_input,
    require_labels,
    require_still,
)
from stereocell.building.out_folder import OutFolder
from stereocell.building.plan import Plan
from stereocell.building.running_pass import begin, end
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box
from stereocell.read.readers import reader_of
from stereocell.storage.workspace import remove


def run_on_input(
    out_folder: OutFolder,
    plan: Plan,
    run: Callable[[], object],
    results: Sequence[Path],
    *,
    is_last: bool = False,
) -> None:
    """Run tasks that read the inputs and write results; an empty list of results runs nothing.

    is_last  whether no other pass follows

    Raises SourceError where an input changed since the plan or while the tasks ran. In the second
    case their results are removed. If the fingerprint did not change, results of the old and the
    new input have the same names, so all results are removed.
    """
    if not results:
        return
    require_input(plan)
    require_added(plan)
    require_labels(plan)
    begin(out_folder, plan, results)
    try:
        run()
    except BaseException:  # a changed input may be its cause, and is then reported instead
        _require_still(out_folder, plan, results, is_last=False)
        raise
    _require_still(out_folder, plan, results, is_last=is_last)


def _require_still(
    out_folder: OutFolder, plan: Plan, results: Sequence[Path], *, is_last: bool
) -> None:
    try:
        require_still(plan, is_last=is_last)
    except InputChangedError as error:
        for result in results if error.has_new_fingerprint else [out_folder.units_dir]:
            remove(result)
        raise
    finally:
        end(out_folder)


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
