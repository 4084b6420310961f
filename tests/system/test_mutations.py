"""A few small changes of a source in every format; `make torture` runs all and prints a table.

They run in a process of their own: each change is read in a fork, and a process that forks must
have no threads.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from support.exhaustive import examples

SWEEP = Path(__file__).parents[1] / "malformed" / "sweep.py"
COUNT = examples(2, 1)  # changes tried on each source


@pytest.mark.slow
def test_changed_source_is_refused_in_one_line_or_read_correctly() -> None:
    command = [sys.executable, str(SWEEP), "--count", str(COUNT)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=900, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    counts = dict(re.findall(r"^\| ([^|]+) \| +(\d+) ", run.stdout, re.MULTILINE))
    assert len(counts) >= 19
    assert int(counts["all"]) >= 33 * COUNT
