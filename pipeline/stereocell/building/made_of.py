"""Find results in OUT that were made of an earlier plan, earlier units or an earlier stage.

A rebuild that is stopped between two phases leaves such results behind, and each is valid by
itself. Therefore each phase records a digest of the documents in OUT that it was made of. The
digest does not depend on code or versions, so results of an earlier version stay valid.
"""

import hashlib
import json

from stereocell.building.out_folder import INDEX, PLAN, SURVEY, OutFolder
from stereocell.model.errors import OutputError
from stereocell.storage.json_files import find_sealed
from stereocell.usd.written_files import digest_of, read_stage_list

FIELD = "made_of"
# Phases after the plan, in the order of a build, each with the parts of OUT that it is made of.
_MADE_OF = {
    "units": ("plan",),
    "stage": ("plan", "units"),
    "bundle": ("stage",),
    "report": ("plan", "units", "stage"),
}


def made_of(out_folder: OutFolder, phase: str) -> str:
    """Return a digest of the parts of OUT that a phase is made of; empty: one is unreadable."""
    parts = [_content_of(out_folder, part) for part in _MADE_OF.get(phase, ())]
    if not parts or None in parts:
        return ""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:20]


def find_stale(out_folder: OutFolder) -> str | None:
    """Return a line on the first phase that was made of an earlier plan, units or stage.

    None: there is no such phase. A record without a digest, of an earlier version, is accepted.
    Damaged documents are reported elsewhere.
    """
    if out_folder.phases_fault() is not None:
        return None
    phases = out_folder.phases()
    for name, parts in _MADE_OF.items():
        entry = phases.get(name)
        if entry is None:
            continue
        if not entry["key"] and name != "units":  # each unit is written whole or not at all
            return f"{out_folder.out / name}: began and did not finish: {_remedy(name)}"
        now = made_of(out_folder, name)
        if now and entry.get(FIELD, now) != now:
            words = " and ".join(filter(None, [", ".join(parts[:-1]), parts[-1]]))
            return (
                f"{out_folder.out / name}: made from another {words} than {out_folder.out} has "
                f"now: {_remedy(name)}"
            )
    return None


def require_current(out_folder: OutFolder) -> None:
    """Raise OutputError if a phase's results were made of an earlier plan, units or stage."""
    if (fault := find_stale(out_folder)) is not None:
        raise OutputError(fault)


def _content_of(out_folder: OutFolder, part: str) -> object:
    """Return the content of the documents that identify a part of OUT; None: unreadable."""
    if part == "plan":
        return find_sealed(out_folder.plan_file, PLAN)
    if part == "units":
        index = find_sealed(out_folder.index_file, INDEX)
        survey = find_sealed(out_folder.survey_file, SURVEY)
        return None if index is None or survey is None else [index, survey]
    try:
        return digest_of(read_stage_list(out_folder.stage_dir))
    except OutputError:
        return None


def _remedy(phase: str) -> str:
    """Return the commands that repeat a phase and all later ones, as one line for a shell."""
    names = list(_MADE_OF)
    commands = (f"stereocell {name} OUT" for name in names[names.index(phase) :])
    return f"run `{' && '.join(commands)}`"
