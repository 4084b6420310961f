"""Write docs/benchmarks.md from the figures in tests/bench/figures: `make benchmarks`.

A file holds one topic: the command that measures it, and tables that each name their machine. A
bench may write a table itself (tests/bench/published.py); other figures are copied from its output.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
FIGURES = ROOT / "tests" / "bench" / "figures"
PAGE = ROOT / "docs" / "benchmarks.md"
# The files of FIGURES in the order of the page
TOPICS = (
    *("surfaces", "objects", "iso_values", "tissue", "scene", "builds", "scale", "breadth"),
    *("exports", "frames", "ray_march", "bricks"),
)
_HEAD = """# Benchmarks

This page has the measured comparisons, for readers who compare programs. For the time and size of
your own build see [Size and time](size-and-time.md).

A table names the machine that it was measured on. Compare figures within a table only, because
machines differ.
"""
_END = "Next: [Size and time](size-and-time.md), or [the decisions](decisions/index.md).\n"


@dataclass(frozen=True, slots=True)
class Table:
    """One table of a topic.

    machine  where and under which load it was measured
    notes    how the figures were measured, in whole sentences; a paragraph each
    columns  names of the columns
    rows     cells as they are shown, as many as columns
    """

    title: str
    machine: str
    notes: list[str]
    columns: list[str]
    rows: list[list[str]]


@dataclass(frozen=True, slots=True)
class Topic:
    """A file of FIGURES.

    about    what is compared, in whole sentences
    command  that measures it
    remarks  what the figures mean, in whole sentences
    """

    title: str
    about: str
    command: str
    tables: list[Table]
    remarks: list[str]


def read(name: str) -> Topic:
    """Return a topic. Raises TypeError if its file lacks a field or has another one."""
    content: dict[str, Any] = json.loads((FIGURES / f"{name}.json").read_text("utf-8"))
    tables = [Table(**table) for table in content.pop("tables")]
    return Topic(tables=tables, **content)


def page() -> str:
    """Return the text of the page."""
    parts = [_HEAD]
    for topic in map(read, TOPICS):
        parts += [f"## {topic.title}\n", f"{topic.about} The command is `{topic.command}`.\n"]
        for table in topic.tables:
            parts += _lines_of(table)
        parts += ["".join(f"- {remark}\n" for remark in topic.remarks)] if topic.remarks else []
    return "\n".join([*parts, _END])


def _lines_of(table: Table) -> Iterator[str]:
    yield f"### {table.title}\n"
    yield f"Measured on {table.machine}.\n"
    if table.notes:
        yield "".join(f"- {note}\n" for note in table.notes)
    lines = [table.columns, ["---"] * len(table.columns), *table.rows]
    yield "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
