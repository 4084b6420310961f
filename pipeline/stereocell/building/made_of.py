"""Whether what a phase left was made of the plan, the units and the stage that lie in OUT now.

Each phase records a digest of the documents in OUT that it was made of, free of code and versions:
so the results of an earlier version stay as good as they were. A rebuild that is stopped between
two phases leaves the results of an earlier plan behind it, each whole by itself.
"""

import hashlib
import json

from stereocell.building.out_folder import INDEX, PLAN, SURVEY, OutFolder
from stereocell.model.errors import OutputError
from stereocell.storage.json_files import find_sealed
from stereocell.usd.written_files import digest_of, read_stage_list

FIELD = "made_of"
# each phase after the plan, in the order of a build, and what it is made of
_MADE_OF = {
    "units": ("plan",),
    "stage": ("plan", "units"),
    "bundle": ("stage",),
    "report": ("plan", "units", "stage"),
}


def made_of(out_folder: OutFolder, phase: str) -> str:
    """Return a digest of what a phase would be made of now; empty: a part can't be read."""
    parts = [_content_of(out_folder, part) for part in _MADE_OF.get(phase, ())]
    if not parts or None in parts:
        return ""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:20]


def find_stale(out_folder: OutFolder) -> str | None:
    """Return a line on the first phase whose results are not of what lies in OUT; None: all are.

    A record of an earlier version says nothing on it; damaged documents are named elsewhere.
    """
    if out_folder.phases_fault() is not None:
        return None
    phases = out_folder.phases()
    for name, parts in _MADE_OF.items():
        entry = phases.get(name)
        if entry is None:
            continue
        if not entry["key"] and name != "units":  # units have no beginning: each is whole or none
            return f"{out_folder.out / name}: begun and not finished: {_remedy(name)}"
        now = made_of(out_folder, name)
        if now and entry.get(FIELD, now) != now:
            words = " and ".join(filter(None, [", ".join(parts[:-1]), parts[-1]]))
            return (
                f"{out_folder.out / name}: made of another {words} than {out_folder.out} holds "
                f"now: {_remedy(name)}"
            )
    return None


def require_current(out_folder: OutFolder) -> None:
    """Raise OutputError where a phase's results are not of what lies in OUT."""
    if (fault := find_stale(out_folder)) is not None:
        raise OutputError(fault)


def _content_of(out_folder: OutFolder, part: str) -> object:
    """Return the content of the documents by which a part of OUT is known; None: unreadable."""
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
    """Return the commands that make a phase and all after it anew, as one line for a shell."""
    names = list(_MADE_OF)
    commands = (f"stereocell {name} OUT" for name in names[names.index(phase) :])
    return f"run `{' && '.join(commands)}`"
