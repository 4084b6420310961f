"""The page of benchmarks shows the figures of their files, and other pages repeat some of them."""

import json
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
# A column or a cell with a time, such as "CPU s" or "4 s + 1.8 s a unit"
TIME = re.compile(r"(^|CPU |\d )(s|seconds|minutes|core-hours)\b|^CPU$")


@dataclass(frozen=True)
class Copy:
    """A figure of a page, which repeats one of a topic of the benchmarks.

    shown     pattern of the figure in the page
    measured  pattern of the figure in the topic, whose cells are separated by " | "
    scale     by which the figure of the topic is multiplied
    """

    page: str
    shown: str
    topic: str
    measured: str
    scale: float = 1.0


AT_ONCE = r"one command \| "
TILE = rf"(?s)By two workers.*sample tile of 194 x 512 x 512.*?{AT_ONCE}"
COPIES = [
    Copy(page, *others)  # type: ignore[arg-type]
    for page, copies in {
        "size-and-time.md": [
            (r"voxels\) \| (\S+) minutes", "scene", r"the build \| (\S+)", 1 / 60),
            (r"minutes \((\d+) s of CPU\)", "scene", r"the build \| \S+ \| (\S+)"),
            (r"minutes \(.*\| (\S+) GB", "scene", r"the build \|.*; (\S+)", 1e-3),
            (r"one such tile, three channels \| (\d+) s", "builds", TILE + r"(\S+)"),
            (r"one such tile.*\((\d+) s of CPU\)", "builds", TILE + r"\S+ \| (\S+)"),
            (r"one such tile.*\| (\S+) GB", "builds", TILE + r"[^;]*; (\S+)", 1e-3),
            (r"64 voxels \| (\S+) minutes", "breadth", r"968 units take (\S+) minutes"),
            (r"64 voxels \|.*\| (\S+) GB", "breadth", r"units \|.* (\d+)\n", 1e-3),
            (r"1000 cells of a label map \| (\d+) to", "objects", r"one tile \| (\d+) s a"),
            (r"1000 cells .* to (\d+) s", "objects", r"(\d+) s a thousand, since"),
            (r"\| (\S+) GB for 20,000", "objects", r"since a tile .*; (\S+) GB a worker"),
        ],
        "decisions/unit-of-work.md": [
            (r"grows by (\d+) % at most", "scale", r"command .*\(bound (\d+)"),
            (r"full of nuclei \| (\S+) GB", "scale", r"full of nuclei.*\| (\S+) GB"),
            (r"memory \| (\S+) MB a tile", "scale", r"MB: (\S+) MB a tile"),
            (r"64\^3 voxels \| (\S+) minutes", "breadth", r"968 units take (\S+) minutes"),
        ],
        "decisions/unit-of-work-scene.md": [
            *(
                (rf"\| {name} \| {shown}", "builds", rf"(?s){table}.*?\*\*{name}.*?{measured}")
                for name in ("sample tile", "brain cells", "head, CT", "head, MRI at 7 T")
                for table, shown, measured in (
                    ("By one worker", r"([^,]+), now", AT_ONCE + r"(?:[^|]+\| ){4}[^;]+; ([^;]+)"),
                    ("By one worker", r"[^|]+now (\S+)", AT_ONCE + r"\S+ \| (\S+)"),
                    (
                        "By two workers",
                        r"(?:[^|]+\| ){2}([^,]+),",
                        AT_ONCE + r"(?:[^|]+\| ){4}([^;]+)",
                    ),
                    ("By two workers", r"(?:[^|]+\| ){2}[^|]+now (\S+)", AT_ONCE + r"(\S+)"),
                )
            ),
            (r"it takes (\S+) minutes", "scene", r"the build \| (\S+)", 1 / 60),
            (r"the deep check (\S+)\.", "scene", r"check \| (\S+)", 1 / 60),
        ],
    }.items()
    for others in copies
]


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


def test_times_are_also_given_as_ratios_to_the_reference_kernel(
    benchmarks: ModuleType, published: ModuleType
) -> None:
    timed = set()
    for topic in map(benchmarks.read, benchmarks.TOPICS):
        for table in topic.tables:
            cells = [cell for row in table.rows for cell in row]
            if not any(map(TIME.search, [*table.columns, *cells])):
                continue
            timed.add(topic.title)
            is_given = any("references" in cell for cell in [*table.columns, *cells])
            assert is_given or published.WITHOUT_REFERENCE in table.notes, table.title
    assert {"A whole build", "Phases of builds", "Many small units", "Exports"} <= timed


@pytest.mark.parametrize("copy", COPIES, ids=lambda copy: f"{copy.page}: {copy.shown}")
def test_a_page_repeats_a_figure_as_it_is_measured(copy: Copy, benchmarks: ModuleType) -> None:
    topic = benchmarks.read(copy.topic)
    lines = [line for table in topic.tables for line in ([table.title], *table.rows)]
    text = "\n".join([*(" | ".join(line) for line in lines), *topic.remarks])
    if copy.measured.startswith(TILE) and "194 x 512 x 512" not in text:
        pytest.skip("the published builds have another tile")
    shown = re.search(copy.shown, (ROOT / "docs" / copy.page).read_text("utf-8"))
    measured = re.search(copy.measured, text)
    assert shown, copy.shown
    assert measured, copy.measured
    decimals = len(shown[1].partition(".")[2])
    assert f"{float(measured[1].replace(',', '')) * copy.scale:.{decimals}f}" == shown[1]


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
