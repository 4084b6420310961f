"""What is asked of every start imports no library: those take seconds where disks are slow."""

import json
import subprocess
import sys

import pytest

# besides the standard library and what setuptools' and editable installs bring into each process
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
        # the number of modules in all, 86 and 152 when this was written, is what a start costs
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
