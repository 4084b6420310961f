"""The report as a phase of a build: it is written anew where its content has changed."""

from functools import partial
from pathlib import Path

from stereocell.building.made_of import FIELD
from stereocell.building.out_folder import OutFolder
from stereocell.building.own_parts import require_own_report
from stereocell.building.phase import digest_of_file, phase_of
from stereocell.building.phases import provenance_record
from stereocell.report import page
from stereocell.storage.cache_key import key_of


def run_report(out: Path) -> None:
    """Write OUT/report/index.html: pictures, sizes, times.

    Raises OutputError where units are missing or damaged.
    """
    out_folder = OutFolder(out)
    with phase_of(out_folder, "report") as phase:
        plan = out_folder.plan()
        out_folder.require_units_of(plan)
        others = {
            name: {field: value for field, value in entry.items() if field != FIELD}
            for name, entry in out_folder.phases().items()
            if name != "report"
        }
        content = [out_folder.index(), out_folder.survey(), provenance_record(plan), others]
        key = key_of([content, page.TEMPLATE.read_text("utf-8")], page)
        done = partial(digest_of_file, out_folder.report_file)
        if not phase.is_done(key, done, require_own=require_own_report):
            page.write_report(out)
