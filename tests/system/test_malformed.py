"""Malformed inputs of malformed/, at least one of each kind; `make torture` runs them all.

They run in a process of their own: each case is a fork, and a process that forks must have no
threads.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from malformed.corpus import all_cases, one_of_each_kind
from support.exhaustive import sweep

SAMPLE = 24
OF_EACH_KIND = ("--each-kind", len(one_of_each_kind(all_cases())))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "count"),
    sweep([OF_EACH_KIND, (f"--sample={SAMPLE}", SAMPLE)], kept=[OF_EACH_KIND]),
)
def test_malformed_input_gives_a_sound_result_or_one_clear_line(
    tmp_path: Path, words: str, count: int
) -> None:
    answer = tmp_path / "faults.json"
    command = [sys.executable, str(Path(__file__).parents[1] / "malformed"), words]
    run = subprocess.run(
        [*command, "--json", str(answer)], capture_output=True, text=True, timeout=900, check=False
    )
    assert answer.exists(), run.stdout + run.stderr
    faults = json.loads(answer.read_text("utf-8"))
    assert len(faults) == count > 10
    assert {name: fault for name, fault in faults.items() if fault} == {}
