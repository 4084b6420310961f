"""Check the seals of OUT's documents before a command relies on them.

`NEEDS` lists the parts of OUT that each command depends on. `stereocell check` checks all parts, by
the same functions. So the first command that would use a damaged or edited record reports it, with
the same remedy as `check`.
"""

from collections.abc import Callable
from functools import partial

from stereocell.building.out_folder import (
    EXPORTS,
    INDEX,
    PHASES,
    PHASES_AGAIN,
    PLAN_KEY,
    PROVENANCE,
    SURVEY,
    OutFolder,
)
from stereocell.model.errors import OutputError
from stereocell.storage.json_files import read_sealed
from stereocell.storage.sealed_text import require_sealed_text
from stereocell.usd import written_files

_PLAN_AGAIN = "run `stereocell plan INPUT -o OUT` again"
UNITS_AGAIN = "run `stereocell units OUT`"
_EXPORTS_AGAIN = "remove it, and export each file once with --force"
_REPORT_AGAIN = "run `stereocell report OUT` again"
# For each command, the parts of OUT that it depends on.
NEEDS = {
    "units": ("plan",),
    "tissue": ("plan",),
    "stage": ("plan", "units"),
    "bundle": ("plan", "stage"),
    "report": ("plan", "units", "stage"),
    "export": ("plan", "phases", "stage"),
    "publish": ("plan", "phases", "units", "stage"),
}
_Check = Callable[[], object]


def require_documents(out_folder: OutFolder, command: str) -> None:
    """Raise OutputError if a document that a command depends on is missing, damaged or edited.

    A folder with a stage or a bundle, but without the records of a build, is accepted.
    """
    if not _is_build(out_folder):
        return
    for part in NEEDS.get(command, ()):
        for check in checks_of(out_folder, part):
            check()


def find_document_faults(out_folder: OutFolder, *parts: str) -> list[str]:
    """Return a line on each document of these parts that is missing, damaged or edited."""
    faults = []
    for check in (check for part in parts for check in checks_of(out_folder, part)):
        try:
            check()
        except OutputError as fault:
            faults.append(str(fault))
    return faults


def checks_of(out_folder: OutFolder, part: str) -> list[_Check]:
    """Return the checks of a part's documents. Each raises OutputError for a fault."""
    return _PARTS[part](out_folder)


def has_units(out_folder: OutFolder) -> bool:
    """Return whether OUT holds units. A copy that is only viewed needs none."""
    return bool(out_folder.names(out_folder.units_dir))


def has_report(out_folder: OutFolder) -> bool:
    """Return whether OUT holds a report, or must: its phase has ended and the units are there."""
    is_recorded = bool(out_folder.phases().get("report", {"key": ""})["key"])
    return out_folder.has(out_folder.report_file) or (is_recorded and has_units(out_folder))


def _is_build(out_folder: OutFolder) -> bool:
    records = (out_folder.plan_file, out_folder.provenance_file, out_folder.units_plan_file)
    return any(map(out_folder.has, records))


def _plan(out_folder: OutFolder) -> list[_Check]:
    settings = out_folder.settings_file
    remedy = f"remove it and {_PLAN_AGAIN}" if out_folder.has(settings) else _PLAN_AGAIN
    return [
        out_folder.plan,
        lambda: read_sealed(out_folder.provenance_file, PROVENANCE, _PLAN_AGAIN),
        lambda: require_sealed_text(settings, remedy),
    ]


def _phases(out_folder: OutFolder) -> list[_Check]:
    return [lambda: read_sealed(out_folder.phases_file, PHASES, PHASES_AGAIN)]


def _units(out_folder: OutFolder) -> list[_Check]:
    schemas = {
        out_folder.index_file: INDEX,
        out_folder.units_plan_file: PLAN_KEY,
        out_folder.survey_file: SURVEY,
    }
    if not has_units(out_folder):
        return []
    return [partial(read_sealed, file, schema, UNITS_AGAIN) for file, schema in schemas.items()]


def _stage(out_folder: OutFolder) -> list[_Check]:
    return [lambda: _require_stage_list(out_folder)]


def _require_stage_list(out_folder: OutFolder) -> None:
    """Raise OutputError unless the stage's list is the one that the stage's phase wrote."""
    if not out_folder.has_begun("stage"):
        return
    out_folder.require_finished("stage")
    listed = written_files.read_stage_list(out_folder.stage_dir)
    wrote = out_folder.phases()["stage"]
    if wrote["results"] != written_files.digest_of(listed):
        raise OutputError(
            f"{out_folder.stage_list}: differs from the list that was written: "
            f"{written_files.REMEDY}"
        )


def _exports(out_folder: OutFolder) -> list[_Check]:
    if not out_folder.has(out_folder.exports_file):
        return []
    return [lambda: read_sealed(out_folder.exports_file, EXPORTS, _EXPORTS_AGAIN)]


def _report(out_folder: OutFolder) -> list[_Check]:
    if not has_report(out_folder):
        return []
    return [lambda: require_sealed_text(out_folder.report_file, _REPORT_AGAIN)]


_PARTS = {
    "plan": _plan,
    "phases": _phases,
    "units": _units,
    "stage": _stage,
    "exports": _exports,
    "report": _report,
}
