"""Check the plan of a build, and the files beside it, against their own hashes.

The files of units, stage and bundle have lists of their own; see formats.py for these checks.
"""

from stereocell.building.made_of import require_current
from stereocell.building.out_folder import OutFolder
from stereocell.building.sealed_documents import checks_of, find_document_faults
from stereocell.model.errors import CheckError, OutputError


def check_plan(out_folder: OutFolder) -> str:
    """Check the hash of plan.json, its schema, and further rules of its reader."""
    plan = out_folder.plan()
    return f"{out_folder.plan_file.name}: {len(plan.tiles)} tiles x {len(plan.channels)} channels"


def check_records(out_folder: OutFolder) -> str:
    """Check the files that planning writes beside plan.json, and the record of the phases.

    Also check that each of units, stage, bundle and report was made from the one before.
    """
    settings, provenance = out_folder.settings_file, out_folder.provenance_file
    faults = find_document_faults(out_folder, "plan", "phases", "exports")
    # The check `plan` reports faults of the plan itself.
    faults = [fault for fault in faults if not fault.startswith(str(out_folder.plan_file))]
    if not find_document_faults(out_folder, "plan", "phases", "units", "stage"):
        # This is skipped for a damaged document, which would be reported again with another remedy.
        try:
            require_current(out_folder)
        except OutputError as fault:
            faults.append(str(fault))
    if faults:
        raise CheckError("; ".join(faults))
    return f"{provenance.name}, {settings.name} and {out_folder.phases_file.name} are as written"


def check_report(out_folder: OutFolder) -> str:
    """Check the report, an HTML page, against the hash that it holds."""
    for check in checks_of(out_folder, "report"):
        check()
    return f"{out_folder.report_file.name} is as written"
