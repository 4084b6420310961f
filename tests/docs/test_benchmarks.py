"""The page of benchmarks shows the figures of their files, and a bench replaces one table."""

import json
import re
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    yield import_module("benchmarks")
    sys.modules.pop("benchmarks")


@pytest.fixture
def published(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    monkeypatch.syspath_prepend(str(ROOT / "tests" / "bench"))
    yield import_module("published")
    sys.modules.pop("published")


def test_the_page_is_made_from_the_files(benchmarks: ModuleType) -> None:
    assert benchmarks.PAGE.read_text("utf-8") == benchmarks.page(), "run `make benchmarks`"
    files = {file.stem for file in benchmarks.FIGURES.iterdir()}
    assert files == set(benchmarks.TOPICS)


def test_each_table_names_its_machine_and_fills_its_columns(benchmarks: ModuleType) -> None:
    for topic in map(benchmarks.read, benchmarks.TOPICS):
        assert topic.tables
        for table in topic.tables:
            assert table.machine, table.title
            assert len(table.columns) > 1, table.title
            assert {len(row) for row in table.rows} == {len(table.columns)}, table.title


def test_the_commands_are_targets_of_make(benchmarks: ModuleType) -> None:
    makefile = (ROOT / "Makefile").read_text("utf-8")
    for topic in map(benchmarks.read, benchmarks.TOPICS):
        if found := re.match(r"make ([\w-]+)", topic.command):
            assert f"\n{found[1]}:" in makefile, topic.command
        else:
            assert topic.command == "stereocell export"


def test_a_bench_replaces_one_table(
    published: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = json.loads((published.FIGURES / "tissue.json").read_text("utf-8"))
    (tmp_path / "tissue.json").write_text(json.dumps(before))
    monkeypatch.setattr(published, "FIGURES", tmp_path)
    title = before["tables"][1]["title"]
    after = json.loads(published.publish("tissue", title, ["a", "b"], [["1", "2"]]).read_text())
    assert after["tables"][1]["rows"] == [["1", "2"]]
    assert re.fullmatch(r"\d+ cores with \d+ GiB of memory", after["tables"][1]["machine"])
    after["tables"][1] |= before["tables"][1]
    assert after == before
