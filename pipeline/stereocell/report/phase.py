"""The report as a phase of a build, which writes it again where its content has changed."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from stereocell.building.made_of import FIELD
from stereocell.building.out_folder import OutFolder
from stereocell.building.phase import phase_of
from stereocell.engine.run import Engine
from stereocell.engine.step import Keyed
from stereocell.planning.provenance import provenance_record


@dataclass(frozen=True, slots=True)
class WriteReport(Keyed):
    """Write the report.

    The fields are all documents of OUT that it shows, its template, and whether it compares levels
    of detail.
    """

    VERSION: ClassVar[int] = 5

    index: Mapping[str, str]
    survey: Mapping[str, Any]
    provenance: Mapping[str, Any]
    phases: Mapping[str, Any]
    template: str
    texture_similarity: bool


def run_report(out: Path, engine: Engine, *, texture_similarity: bool = False) -> None:
    """Write OUT/report/index.html, where its content has changed.

    texture_similarity  whether pictures of coarser levels are compared with the finest level

    Raises OutputError where units are missing, TasksFailedError where units are damaged.
    """
    out_folder = OutFolder(out)
    with phase_of(out_folder, "report") as phase:
        plan = out_folder.plan()
        out_folder.require_units_of(plan)
        from stereocell.report.page import TEMPLATE, write_report  # slow to import

        others = {
            name: {field: value for field, value in entry.items() if field != FIELD}
            for name, entry in out_folder.phases().items()
            if name != "report"
        }
        step = WriteReport(
            out_folder.index(),
            out_folder.survey(),
            provenance_record(plan),
            others,
            TEMPLATE.read_text("utf-8"),
            texture_similarity,
        )
        if not phase.is_done(step):
            write_report(out, engine, texture_similarity=texture_similarity)
