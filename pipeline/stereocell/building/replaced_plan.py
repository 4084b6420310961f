"""Replace the plan in OUT by another plan of the same input, but never a user's own settings."""

from stereocell.building.out_folder import OutFolder
from stereocell.model.errors import OutputError, UsageError
from stereocell.planning.plan import Plan
from stereocell.planning.settings import load
from stereocell.storage.contents import contents_of
from stereocell.storage.overwriting import is_forced, or_force
from stereocell.storage.sealed_text import is_sealed_text


def replace_plan(out_folder: OutFolder, plan: Plan) -> bool:
    """Write plan.json, and return whether it changed.

    Raises OutputError if OUT holds a build of another input.
    """
    if replaced_plan(out_folder, plan) == plan:
        return False
    out_folder.save_plan(plan)
    return True


def replaced_plan(out_folder: OutFolder, plan: Plan) -> Plan | None:
    """Return the plan in OUT that `plan` would replace; None: there is none.

    Raises OutputError, except with --force, if the plan in OUT was changed by hand or belongs to
    another input.
    """
    try:
        there = out_folder.plan() if out_folder.has(out_folder.plan_file) else None
    except OutputError:
        if not is_forced():
            raise
        return None
    fingerprint = contents_of(out_folder.out).fingerprint if there is None else there.fingerprint
    if fingerprint not in ("", plan.fingerprint) and not is_forced():
        found = f"another input (fingerprint {fingerprint[:12]})"
        found = found if there is None else _what_differs(there, plan)
        raise OutputError(
            f"{out_folder.out}: holds a build of {found}: {or_force('choose another OUT')}"
        )
    return there


def require_own_settings(out_folder: OutFolder, plan: Plan, there: Plan | None) -> None:
    """Raise OutputError if OUT/stereocell.toml is the user's own file and not a plan's record."""
    file = out_folder.settings_file
    if not out_folder.has(file) or is_sealed_text(file) or is_forced():
        return
    try:
        found = load(None, file, flags={})
    except UsageError:
        found = None
    if found is None or found not in (plan.settings, there and there.settings):
        raise OutputError(
            f"{file}: found a file that was edited by hand, expected the record of an earlier "
            "plan: " + or_force("move it elsewhere and pass it by --config")
        )


def _what_differs(there: Plan, plan: Plan) -> str:
    """Return the difference between the two inputs: OUT's, then the requested one."""
    old, new = there.settings.plan, plan.settings.plan
    if there.source == plan.source and old.time != new.time:
        return f"{there.name!r} with --time {old.time}, not {new.time}"
    if there.source == plan.source and old.series != new.series:
        return f"{there.name!r} with --series {old.series}, not {new.series}"
    if there.source == plan.source and old.spacing_um != new.spacing_um:
        return f"{there.name!r} with {_spacing(old.spacing_um)}, not {_spacing(new.spacing_um)}"
    return (
        f"{there.name!r} (fingerprint {there.fingerprint[:12]}), "
        f"not of {plan.name!r} ({plan.fingerprint[:12]})"
    )


def _spacing(spacing_um: tuple[float, ...]) -> str:
    if not spacing_um:
        return "the file's own voxel spacing"
    return "--spacing-um " + ",".join(f"{length:g}" for length in spacing_um)
