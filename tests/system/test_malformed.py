"""A sample of the malformed inputs in malformed/, spread evenly; `make torture` runs them all.

In a process of their own: each case is a fork, and what forks has to have no threads.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SAMPLE = 24


@pytest.mark.slow
def test_each_ends_in_a_sound_result_or_one_clear_line(tmp_path: Path) -> None:
    answer = tmp_path / "faults.json"
    command = [
        sys.executable,
        str(Path(__file__).parents[1] / "malformed"),
        "--sample",
        str(SAMPLE),
    ]
    run = subprocess.run(
        [*command, "--json", str(answer)], capture_output=True, text=True, timeout=900, check=False
    )
    assert answer.exists(), run.stdout + run.stderr
    faults = json.loads(answer.read_text())
    assert len(faults) == SAMPLE
    assert {name: fault for name, fault in faults.items() if fault} == {}
