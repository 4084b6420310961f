"""The table in docs/systems.md fits the requirements (`make platforms`)."""

import re
import tomllib
from datetime import date
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
CELL = re.compile(
    r"(no|3\.\d\d( to 3\.\d\d)?(, 3\.\d\d( to 3\.\d\d)?)*)(, glibc 2\.35)?( \([A-Za-z0-9._, -]+\))?"
)


@pytest.fixture(scope="module")
def platforms() -> ModuleType:
    """docs/platforms.py, as `make platforms` runs it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "docs"))
        return import_module("platforms")


def made(platforms: ModuleType) -> str:
    page = (ROOT / "docs" / "systems.md").read_text("utf-8")
    return str(page.split(platforms.BEGIN)[1].split(platforms.END)[0])


def test_the_table_has_a_row_for_each_extra_and_a_column_for_each_system(
    platforms: ModuleType,
) -> None:
    table = made(platforms).split("The requirements that were resolved")[0]
    lines = [line for line in table.splitlines() if line.startswith("|")]
    head, _, *rows = [[part.strip() for part in line.strip("|").split("|")] for line in lines]
    assert head[1:] == [*platforms.SYSTEMS]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = [f"`{name}`" for name in project["optional-dependencies"]]
    assert [row[0] for row in rows] == [platforms.CORE, *extras]
    for name, *cells in rows:
        for text in cells:
            assert CELL.fullmatch(text), f"{name}: {text}"


def test_the_table_is_up_to_date_with_the_requirements(platforms: ModuleType) -> None:
    named = dict(re.findall(r"^\| (.+?) \| (`.+`) \|$", made(platforms), re.MULTILINE))
    there = {row: re.findall(r"`([^`]+)`", lines) for row, lines in named.items()}
    assert there == platforms.rows(), "run `make platforms`"


def test_most_pairs_of_a_system_and_a_python_install_without_a_compiler(
    platforms: ModuleType,
) -> None:
    (good,) = re.findall(r"^(\d+) of 20 pairs", made(platforms), re.MULTILINE)
    assert int(good) >= 19


def test_a_package_without_a_wheel_is_named_in_its_cell(platforms: ModuleType) -> None:
    words = """error: No solution found when resolving dependencies
      cause: Because only numba{platform_machine == 'x86_64'}<=0.62.1 is available and numba has no
    usable wheels, we can conclude that your requirements are unsatisfiable."""
    assert platforms.blamed(words) == "numba"
    words = (
        "cause: Because only the following versions of onnxruntime are available: onnxruntime<=1.2"
    )
    assert platforms.blamed(words) == "onnxruntime"
    fine, newer, lacking = platforms.Found(""), platforms.Found("", True), platforms.Found("x")
    cells = {
        "3.11 to 3.14": [fine] * 4,
        "3.11 to 3.12, 3.14 (x)": [fine, fine, lacking, fine],
        "3.13, glibc 2.35 (x)": [lacking, lacking, newer, lacking],
        "no (x)": [lacking] * 4,
    }
    for text, found in cells.items():
        assert platforms.cell(dict(zip(platforms.PYTHONS, found, strict=True))) == text


def test_a_made_table_fits_between_the_markers_again(platforms: ModuleType) -> None:
    found = {
        (row, system, python): platforms.Found("numba" if python == "3.14" else "")
        for row in platforms.rows()
        for system in platforms.SYSTEMS
        for python in platforms.PYTHONS
    }
    text = platforms.table(found, date(2026, 1, 2))
    assert text.startswith(platforms.BEGIN)
    assert text.endswith(platforms.END)
    assert "\n15 of 20 pairs of a system and a Python resolve, on 2026-01-02.\n" in text
    assert f"| {platforms.CORE} |{' 3.11 to 3.13 (numba) |' * 5}\n" in text
