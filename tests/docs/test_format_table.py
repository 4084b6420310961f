"""The page of formats has the table of all that are read."""

import sys
from importlib import import_module
from pathlib import Path

import pytest

from stereocell.read.known_formats import known_formats

DOCS = Path(__file__).parents[2] / "docs"


def test_the_table_of_formats_is_that_of_their_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS))
    format_table = import_module("format_table")
    text = format_table.PAGE.read_text("utf-8")
    assert format_table.page(text) == text, "run `make format-table`"
    lines = format_table.table().splitlines()
    assert len(lines) == 2 + sum(len(one.guides) for one in known_formats().values())
    assert len({line.count(" | ") for line in lines}) == 1
    sys.modules.pop("format_table")
