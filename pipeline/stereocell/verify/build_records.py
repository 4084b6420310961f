"""Check the records of a build against their own hashes: the plan and the files beside it.

The files of units, stage and bundle are checked against lists of their own: see formats.py.
"""

from stereocell.building.made_of import require_current
from stereocell.building.out_folder import OutFolder
from stereocell.building.sealed_documents import checks_of, find_document_faults
from stereocell.model.errors import CheckError, OutputError


def check_plan(out_folder: OutFolder) -> str:
    """Check plan.json: its hash, its schema, and the other rules of its reader."""
    plan = out_folder.plan()
    return f"{out_folder.plan_file.name}: {len(plan.tiles)} tiles x {len(plan.channels)} channels"


def check_records(out_folder: OutFolder) -> str:
    """Check the files that a plan writes beside plan.json, and the record of the phases.

    Also check that units, stage, bundle and report were made of each other.
    """
    settings, provenance = out_folder.settings_file, out_folder.provenance_file
    faults = find_document_faults(out_folder, "plan", "phases", "exports")
    # the line `plan` says what is wrong with the plan itself
    faults = [fault for fault in faults if not fault.startswith(str(out_folder.plan_file))]
    if not find_document_faults(out_folder, "plan", "phases", "units", "stage"):
        # a damaged document would be told twice, with the remedy of what was made of it
        try:
            require_current(out_folder)
        except OutputError as fault:
            faults.append(str(fault))
    if faults:
        raise CheckError("; ".join(faults))
    return f"{provenance.name}, {settings.name} and {out_folder.phases_file.name} as written"


def check_report(out_folder: OutFolder) -> str:
    """Check the report against the hash in it."""
    for check in checks_of(out_folder, "report"):
        check()
    return f"{out_folder.report_file.name} as written"
