"""The examples in docstrings print what they state, quickly, and leave no file behind.

The functions that a reader meets first each have one: those of `import stereocell`, and the steps
in the table of docs/python.md.
"""

import doctest
import re
import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

import stereocell
from support.small_viewer import write_small_viewer

ROOT = Path(__file__).parents[2]
PIPELINE = ROOT / "pipeline"
MODULES = [
    ".".join(file.relative_to(PIPELINE).with_suffix("").parts)
    for file in sorted(PIPELINE.rglob("*.py"))
    if ">>> " in file.read_text("utf-8")
]
MAX_LINES = 8  # of an example, without the lines that it prints
# Examples that build, which takes seconds
SLOW = {"stereocell.api.build", "stereocell.notebook.show.show"}
# Packages without which an example can't run
EXTRAS = {"stereocell.textures.unwrap": "xatlas", "stereocell.notebook.show": "anywidget"}


def examples(module: str) -> Iterator[doctest.DocTest]:
    """Yield the examples of a module, without those that only contain others."""
    found = doctest.DocTestFinder().find(import_module(module))
    yield from (one for one in found if one.examples)


def run(example: doctest.DocTest, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run an example in an empty folder, where temporary files go, too."""
    printed: list[str] = []
    monkeypatch.chdir(folder)
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    runner = doctest.DocTestRunner(verbose=False)
    failed, attempted = runner.run(example, out=printed.append)
    assert failed == 0, "".join(printed)
    assert attempted


@pytest.mark.parametrize("module", MODULES)
def test_examples_print_what_they_state(
    module: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if module in EXTRAS:
        pytest.importorskip(EXTRAS[module])
    for example in examples(module):
        if example.name not in SLOW:
            run(example, tmp_path, monkeypatch)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("name", sorted(SLOW))
def test_examples_that_build_print_what_they_state(
    name: str,
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    module = name.rpartition(".")[0]
    if module in EXTRAS:
        pytest.importorskip(EXTRAS[module])
    viewer = write_small_viewer(tmp_path_factory.mktemp("viewer"))
    monkeypatch.setattr("stereocell.bundle.blob_page.viewer_dist", lambda: viewer)
    ended = []
    monkeypatch.setattr("atexit.register", lambda *call, **named: ended.append((call, named)))
    (example,) = (one for one in examples(module) if one.name == name)
    run(example, tmp_path, monkeypatch)
    for (remove, *folders), named in ended:  # as when Python ends
        remove(*folders, **named)
    assert list(tmp_path.iterdir()) == []


def test_functions_that_a_reader_meets_first_have_a_short_example() -> None:
    page = (ROOT / "docs" / "python.md").read_text("utf-8")
    table = page[page.index("| step | function |") :]
    listed = [f"stereocell.{name}" for name in re.findall(r"`(\w+\.\w+\.\w+)`", table)]
    starts = [getattr(stereocell, name) for name in stereocell.__all__]
    listed += [
        f"{one.__module__}.{one.__name__}"
        for one in starts
        if callable(one) and not isinstance(one, type)
    ]
    listed += ["stereocell.read.open_dataset.open", "stereocell.isosurface.repair.repair"]
    assert len(set(listed)) >= 20
    for name in sorted(set(listed)):
        module = name.rpartition(".")[0]
        lines = [
            example.source.count("\n")
            for one in examples(module)
            if one.name == name
            for example in one.examples
        ]
        assert 0 < sum(lines) <= MAX_LINES, name
