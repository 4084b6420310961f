"""Check the records of a build against their own hashes: the plan and the files beside it.

The files of units, stage and bundle are checked against lists of their own: see formats.py.
"""

from collections.abc import Callable

from stereocell.building.made_of import require_current
from stereocell.building.out_folder import EXPORTS, INDEX, PHASES, PLAN_KEY, PROVENANCE, OutFolder
from stereocell.model.errors import CheckError, OutputError
from stereocell.storage.json_files import read_sealed
from stereocell.storage.sealed_text import require_sealed_text
from stereocell.storage.workspace import is_file

_PLAN_AGAIN = "run `stereocell plan INPUT -o OUT` again"
_SETTINGS_AGAIN = f"remove it and {_PLAN_AGAIN}"
_PHASES_AGAIN = (
    "run `stereocell units OUT && stereocell stage OUT && stereocell bundle OUT && "
    "stereocell report OUT` again"
)
_EXPORTS_AGAIN = "remove it: the next export of each file then takes --force"
_REPORT_AGAIN = "run `stereocell report OUT` again"


def check_plan(out_folder: OutFolder) -> str:
    """Check plan.json: its hash, its schema, and the other rules of its reader."""
    plan = out_folder.plan()
    return f"{out_folder.plan_file.name}: {len(plan.tiles)} tiles x {len(plan.channels)} channels"


def check_records(out_folder: OutFolder) -> str:
    """Check the files that a plan writes beside plan.json, and the record of the phases.

    Also check that units, stage, bundle and report were made of each other.
    """
    settings, provenance = out_folder.settings_file, out_folder.provenance_file
    checks: list[Callable[[], object]] = [
        lambda: read_sealed(provenance, PROVENANCE, _PLAN_AGAIN),
        lambda: require_sealed_text(
            settings, _SETTINGS_AGAIN if is_file(settings) else _PLAN_AGAIN
        ),
        lambda: read_sealed(out_folder.phases_file, PHASES, _PHASES_AGAIN),
    ]
    if is_file(out_folder.exports_file):
        checks.append(lambda: read_sealed(out_folder.exports_file, EXPORTS, _EXPORTS_AGAIN))
    checks.append(lambda: require_current(out_folder))
    _raise_on(find_faults(checks))
    return f"{provenance.name}, {settings.name} and {out_folder.phases_file.name} as written"


def check_report(out_folder: OutFolder) -> str:
    """Check the report against the hash in it."""
    require_sealed_text(out_folder.report_file, _REPORT_AGAIN)
    return f"{out_folder.report_file.name} as written"


def find_index_faults(out_folder: OutFolder) -> list[str]:
    """Return the faults of the list of units, and of the record of their plan.

    They name no remedy: the caller has one for all faults of the units.
    """
    faults = find_faults(
        [
            lambda: read_sealed(out_folder.index_file, INDEX, ""),
            lambda: read_sealed(out_folder.units_plan_file, PLAN_KEY, ""),
        ]
    )
    return [fault.removesuffix(": ") for fault in faults]


def find_faults(checks: list[Callable[[], object]]) -> list[str]:
    """Return the text of each error that a check raises."""
    faults = []
    for check in checks:
        try:
            check()
        except OutputError as fault:
            faults.append(str(fault))
    return faults


def _raise_on(faults: list[str]) -> None:
    if faults:
        raise CheckError("; ".join(faults))
