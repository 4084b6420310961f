"""Keep a note in OUT on the running pass, so that the results of a killed pass can be checked.

An input may have changed during a killed pass, which leaves its note behind. The next command
compares the inputs with the note, and removes the results of that pass if they differ.
"""

import hashlib
from collections.abc import Sequence
from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.engine.run import console
from stereocell.planning.input_files import open_states
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import source_of
from stereocell.storage.json_files import find_json, write_json

_SCHEMA = "units.schema.json#Running"


def begin(out_folder: OutFolder, plan: Plan, results: Sequence[Path]) -> None:
    """Write the note on the inputs, and on the results that a pass is about to make."""
    names = [result.relative_to(out_folder.out).as_posix() for result in results]
    write_json(out_folder.running_file, {"inputs": _digest(plan), "results": names})


def end(out_folder: OutFolder) -> None:
    """Remove the note, after the pass has ended and its inputs have been compared."""
    out_folder.remove(out_folder.running_file)


def remove_mixed(out_folder: OutFolder, plan: Plan) -> None:
    """Remove the results of a killed pass if an input has changed since the pass began."""
    left = find_json(out_folder.running_file, _SCHEMA)
    if left is None:
        return
    if left["inputs"] != _digest(plan):
        console.print(
            "units: an earlier command was stopped while it read an input, and the input changed "
            "since then: the last results of that command are built again"
        )
        for result in (out_folder.out / name for name in left["results"]):
            if result.is_relative_to(out_folder.units_dir) and ".." not in result.parts:
                out_folder.remove(result)
    end(out_folder)


def _digest(plan: Plan) -> str:
    """Return a digest of the state of all input files. Small files count by their content."""
    digest = hashlib.sha256()
    for ref in (source_of(plan), *(labels.ref for labels in plan.labels)):
        digest.update("".join(open_states(ref).lines()).encode())
    return digest.hexdigest()
