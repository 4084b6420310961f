"""Commands start without importing libraries, which take seconds on slow disks."""

import json
import subprocess
import sys

import pytest

from stereocell.cli.__main__ import COMMANDS
from support.missing_inputs import MISSING_INPUTS

# Libraries that take long to import. A command needs them only once it has found its input.
LARGE = {
    "distributed",
    "h5py",
    "igl",
    "imagecodecs",
    "matplotlib",
    "nibabel",
    "numba",
    "OpenEXR",
    "pandas",
    "PIL",
    "pxr",
    "pydicom",
    "scipy",
    "skimage",
    "sklearn",
    "vtkmodules",
    "zarr",
}
WITHOUT_INPUT = {"sample", "doctor", "settings"}
FAIL = """
from stereocell.cli.__main__ import main
assert main({words}) == 1
"""
# Allowed besides the standard library and modules that installed packages load into each process
OURS = {"stereocell", "__main__", "_distutils_hack", "sitecustomize", "usercustomize"}
HELP = """
from stereocell.cli.__main__ import main
try:
    main({words})
except SystemExit as end:
    assert not end.code
"""
TELL = "\nimport json, sys; print(); print(json.dumps(sorted(sys.modules)))"


@pytest.mark.parametrize(
    ("code", "most"),
    [
        # The number of modules determines the time of a start: 86 and 152 when this was written.
        ("import stereocell", 120),
        (HELP.format(words=["--help"]), 200),
        (HELP.format(words=["build", "--help"]), None),
    ],
    ids=["import", "help", "help of a command"],
)
def test_a_start_imports_no_library(code: str, most: int | None) -> None:
    done = subprocess.run(
        [sys.executable, "-c", code + TELL], capture_output=True, text=True, check=True
    )
    modules = json.loads(done.stdout.splitlines()[-1])
    roots = {name.partition(".")[0] for name in modules}
    foreign = {name for name in roots - OURS if not name.startswith("__editable__")}
    assert foreign - set(sys.stdlib_module_names) == set()
    assert most is None or len(modules) <= most


def test_every_command_with_an_input_is_tried() -> None:
    assert {words[0] for words in MISSING_INPUTS.values()} == COMMANDS.keys() - WITHOUT_INPUT


@pytest.mark.parametrize("words", MISSING_INPUTS.values(), ids=MISSING_INPUTS)
def test_a_missing_input_is_reported_before_a_large_library_is_imported(words: list[str]) -> None:
    assert _roots_after(FAIL.format(words=words)) & LARGE == set()


def test_doctor_imports_no_large_library() -> None:
    code = 'from stereocell.cli.__main__ import main\nmain(["doctor"])'
    assert _roots_after(code) & LARGE == set()


@pytest.mark.parametrize(
    ("module", "unneeded"),
    [
        ("building.phases", LARGE),
        ("export.export_build", LARGE),
        ("export.write", {"nibabel", "pydicom", "skimage", "sklearn", "distributed"}),
        ("live.is_source", LARGE),
        ("planning.plan", LARGE),
        ("report.page", {"pxr", "skimage", "nibabel", "OpenEXR"}),
        ("serve.server", LARGE - {"PIL"}),
        ("transfer.opacity", LARGE),
        ("verify.formats", LARGE),
    ],
)
def test_a_module_imports_no_library_that_few_of_its_users_need(
    module: str, unneeded: set[str]
) -> None:
    assert _roots_after(f"import stereocell.{module}") & unneeded == set()


def _roots_after(code: str) -> set[str]:
    """Return the names of all packages that a new process has imported after this code."""
    done = subprocess.run(
        [sys.executable, "-c", code + TELL], capture_output=True, text=True, check=True
    )
    roots = {name.partition(".")[0] for name in json.loads(done.stdout.splitlines()[-1])}
    assert "stereocell" in roots
    return roots
