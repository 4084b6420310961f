"""Commands start without importing libraries, which take seconds on slow disks."""

import json
import subprocess
import sys

import pytest

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


def test_a_plan_waits_for_no_library_of_later_phases() -> None:
    code = "import stereocell.building.phases"
    done = subprocess.run(
        [sys.executable, "-c", code + TELL], capture_output=True, text=True, check=True
    )
    roots = {name.partition(".")[0] for name in json.loads(done.stdout.splitlines()[-1])}
    assert "numpy" in roots
    assert roots & {"pxr", "igl", "zarr", "vtkmodules", "OpenEXR"} == set()
