"""Put a table that a bench has measured into its topic of docs/benchmarks.md."""

import json
import os
from collections.abc import Sequence
from pathlib import Path

import psutil

FIGURES = Path(__file__).parent / "figures"
# Note of a table whose times were measured without the reference kernel
WITHOUT_REFERENCE = (
    "These figures are older than the reference kernel of the benches, so they can't be compared "
    "with those of another machine."
)


def machine() -> str:
    """Return the machine in words, for a bench that uses processor cores alone."""
    memory = psutil.virtual_memory().total / 2**30
    return f"{os.cpu_count()} cores with {memory:.0f} GiB of memory"


def publish(
    topic: str,
    title: str,
    columns: Sequence[str],
    rows: Sequence[Sequence[str]],
    circumstances: str = "",
) -> Path:
    """Replace columns, rows and machine of one table, and return the topic's file.

    The table is found by its title. Its note of figures without a reference is removed.
    `make benchmarks` then writes the page again.

    circumstances  what was measured beside the figures, such as the reference kernel's time
    """
    file = FIGURES / f"{topic}.json"
    content = json.loads(file.read_text("utf-8"))
    (table,) = (one for one in content["tables"] if one["title"] == title)
    place = ", ".join(filter(None, (machine(), circumstances)))
    table["notes"] = [note for note in table["notes"] if note != WITHOUT_REFERENCE]
    table |= {"machine": place, "columns": [*columns], "rows": [[*row] for row in rows]}
    file.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return file
