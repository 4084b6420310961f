"""The folder into which a source is built while its page is open.

Modules that need USD are imported only if the folder holds a build, since that takes seconds.
"""

import re
from dataclasses import replace
from itertools import count
from pathlib import Path

from stereocell.building.out_folder import OutFolder, require_build_or_nothing
from stereocell.building.replaced_plan import replaced_plan, require_own_settings
from stereocell.planning.plan import Plan
from stereocell.read.source_place import require_apart, working_folder_outside
from stereocell.storage.contents import contents_of
from stereocell.storage.kinds import Kind
from stereocell.storage.lock import alone_in


def free_place(plan: Plan) -> Path:
    """Return the path for a build's folder, in the working folder and named after the specimen.

    If the working folder is itself the source, the new folder lies beside it, since nothing may be
    written into the data. The name gets a number if other specimens or files already have it.
    """
    name = re.sub(r"[^\w.+-]+", "_", plan.name).strip("._-") or "specimen"
    folder = working_folder_outside(plan.source)
    for number in count(1):
        place = folder / (f"{name}.stereocell" if number == 1 else f"{name}-{number}.stereocell")
        found = contents_of(place)
        is_ours = found.kind is Kind.BUILD and found.fingerprint in ("", plan.fingerprint)
        if is_ours or found.kind is Kind.NOTHING:
            return place
    raise AssertionError("numbers do not end")


def require_place(source: str, out: Path, plan: Plan) -> None:
    """Raise the errors that a build of a plan into OUT would raise at once; change nothing.

    Raises StereoCellError if OUT lies in the source, can't be written or holds something else, or
    if another command is writing there.
    """
    require_apart(source, out)
    require_build_or_nothing(out, source)
    out_folder = OutFolder(out)
    out_folder.require_name()
    there = replaced_plan(out_folder, plan)
    require_own_settings(out_folder, plan, there)
    if there is not None:
        from stereocell.building.own_parts import require_own_places

        require_own_places(out_folder, is_same_plan=_is_same(there, plan))
    with alone_in(out, "view"):  # this raises if another command is writing into OUT
        pass


def finished_bundle(out: Path, plan: Plan) -> Path | None:
    """Return OUT/bundle if a build of this plan has finished and its results are whole, else None.

    Raises OutputError if OUT's plan was changed by hand.
    """
    there = replaced_plan(OutFolder(out), plan)
    if there is None or not _is_same(there, plan):
        return None
    from stereocell.building.phase import is_finished

    return out / "bundle" if is_finished(OutFolder(out)) else None


def _is_same(there: Plan, plan: Plan) -> bool:
    """Return whether two plans differ at most in their notes, which do not affect a build."""
    return replace(there, notes=()) == replace(plan, notes=())
