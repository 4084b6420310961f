"""Run steps that read a plan's inputs, and compare the inputs before and after."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

from stereocell.building.input_unchanged import (
    InputChangedError,
    require_added,
    require_input,
    require_labels,
    require_still,
)
from stereocell.building.out_folder import OutFolder
from stereocell.building.running_pass import begin, end
from stereocell.engine.run import Engine
from stereocell.engine.run_steps import Task, run_missing
from stereocell.planning.plan import Plan


def run_on_input(
    out_folder: OutFolder,
    plan: Plan,
    run: Callable[[], object],
    results: Sequence[Path],
    *,
    is_last: bool = False,
) -> None:
    """Call a function that reads the inputs and writes results. Without results, do nothing.

    run      runs the steps of one pass
    results  places of their results
    is_last  whether no other pass follows

    Raises SourceError if an input changed since the plan or while the steps ran. In the second case
    their results are removed. If the fingerprint stayed the same, results of the old and the new
    input have the same names, so all results are removed.
    """
    if not results:
        return
    require_input(plan)
    require_added(plan)
    require_labels(plan)
    begin(out_folder, plan, results)
    try:
        run()
    except BaseException:  # if a changed input may be the cause, that is reported instead
        _require_still(out_folder, plan, results, is_last=False)
        raise
    _require_still(out_folder, plan, results, is_last=is_last)


def run_pass(
    out_folder: OutFolder,
    plan: Plan,
    engine: Engine,
    label: str,
    wanted: Iterable[Task],
    *,
    is_last: bool = False,
) -> int:
    """Run the steps of one pass whose results are missing, and return their number.

    label    name of the pass, for progress and errors
    is_last  whether no other pass follows

    Raises SourceError as `run_on_input` does, TasksFailedError if steps fail.
    """
    guard = partial(run_on_input, out_folder, plan, is_last=is_last)
    return run_missing(engine, label, wanted, guard)


def _require_still(
    out_folder: OutFolder, plan: Plan, results: Sequence[Path], *, is_last: bool
) -> None:
    try:
        require_still(plan, is_last=is_last)
    except InputChangedError as error:
        for result in results if error.has_new_fingerprint else [out_folder.units_dir]:
            out_folder.remove(result)
        raise
    finally:
        end(out_folder)
