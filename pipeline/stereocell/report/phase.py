"""The report as a phase of a build: it is drawn where what it shows has changed."""

from functools import partial
from pathlib import Path

from stereocell.building.out_folder import Store
from stereocell.building.phases import digest_of, phase_of, provenance
from stereocell.report import page
from stereocell.storage.cache_key import key_of


def run_report(out: Path) -> None:
    """Write OUT/report/index.html: pictures, sizes, times."""
    store = Store(out)
    with phase_of(store, "report") as phase:
        plan = store.plan()
        store.require_units_of(plan)
        others = {name: entry for name, entry in store.phases().items() if name != "report"}
        content = [store.index(), store.survey(), provenance(plan), others]
        key = key_of([content, page.TEMPLATE.read_text()], page)
        if not phase.is_done(key, partial(digest_of, [store.report_file])):
            page.write_report(out)
