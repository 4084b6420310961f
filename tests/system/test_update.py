"""Finished results stay valid when an update changes no result, and only then."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from support import phantoms
from support.digests import digests_of

pytestmark = pytest.mark.slow

TESTS = Path(__file__).parents[1]
BUILD = ("build", "f.ome.tif", "-o", "out", "--workers", "0", "--grid", "2x1")
PHASES = ("plan", "units", "stage", "bundle", "report")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a source and its finished build, which a process of its own made."""
    folder = tmp_path_factory.mktemp("build")
    phantoms.write_ome_tiff(folder / "f.ome.tif", phantoms.f_phantom())
    _run(folder, "stereocell.cli", *BUILD)
    return folder


def _run(folder: Path, *command: str) -> list[str]:
    """Run a module with arguments in a process of its own; return the lines that it printed."""
    done = subprocess.run(
        [sys.executable, "-m", *command],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(TESTS)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [*done.stdout.splitlines(), *done.stderr.splitlines()]


def _run_rewritten(folder: Path, *command: str) -> list[str]:
    """Run a command of StereoCell with rewritten code; return the lines that it printed."""
    lines = _run(folder, "support.rewritten_source", *command)
    modules, variables, calls = next(
        map(int, line.split()[1:]) for line in lines if line.startswith("rewritten: ")
    )
    assert modules > 250
    assert variables > 3000
    assert calls > 1000
    return lines


def _times(folder: Path) -> dict[str, int]:
    """Return when each result was written, without documents that every run writes again."""
    lists = {"survey.json", "done.json", "plan.key"}
    return {
        str(file): file.stat().st_mtime_ns
        for part in ("units", "stage", "bundle", "report")
        for file in sorted((folder / "out" / part).rglob("*"))
        if file.is_file() and file.name not in lists
    }


def test_results_stay_valid_if_rewritten_code_gives_the_same_results(built: Path) -> None:
    """The rewritten code has other comments, docstrings, log lines and local variables."""
    digests, times = digests_of(built / "out"), _times(built)
    lines = _run_rewritten(built, *BUILD)
    assert [line for line in lines if line.endswith("up to date")] == [
        f"{phase}: up to date" for phase in PHASES
    ]
    # Progress lines would mean that a step did work.
    assert not [line for line in lines if "1/" in line.partition(" ")[2][:2]]
    assert _times(built) == times
    assert digests_of(built / "out") == digests


def test_results_of_a_step_are_made_again_after_its_version_is_raised(built: Path) -> None:
    lines = _run_rewritten(built, "--raise=BuildUnit", "units", "out", "--workers", "0")
    assert [line for line in lines if line.startswith("units: 1/2")]
    for other in ("windows", "evidence", "components"):
        assert not [line for line in lines if line.startswith(f"{other}: ")]
    assert "units: up to date" not in lines
