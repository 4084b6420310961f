"""Time the start of commands, beside a Python that does nothing.

Each command ends early, after `--help` or because its input is missing. The table has seconds, CPU
seconds, and CPU seconds divided by those of the reference kernel (machine.py). Each figure is the
least of ROUNDS processes; bytecode and files are in the system's cache.
"""

import os
import subprocess
import sys
import time

from machine import measure_reference, stated

from support.missing_inputs import MISSING_INPUTS

ROUNDS = 7
PROGRAMS = {
    "python": ["-c", ""],
    "import stereocell": ["-c", "import stereocell"],
    "stereocell --help": ["-m", "stereocell.cli", "--help"],
    "stereocell build --help": ["-m", "stereocell.cli", "build", "--help"],
    "imports of all phases of a build": ["-c", "import stereocell.building.phases"],
    "import stereocell; stereocell.build": ["-c", "import stereocell; stereocell.build"],
    "doctor": ["-m", "stereocell.cli", "doctor"],
    "settings": ["-m", "stereocell.cli", "settings"],
    **{
        f"{name}, input missing": ["-m", "stereocell.cli", *words]
        for name, words in MISSING_INPUTS.items()
    },
}


def measure(words: list[str]) -> tuple[float, float]:
    """Return the seconds and the CPU seconds of one process."""
    before, start = os.times(), time.perf_counter()
    subprocess.run([sys.executable, *words], capture_output=True, check=False)
    took, after = time.perf_counter() - start, os.times()
    cpu = after.children_user + after.children_system
    return took, cpu - before.children_user - before.children_system


def main() -> None:
    print(f"{'':36} {'s':>6} {'CPU s':>6} {'references':>10}")
    for name, words in PROGRAMS.items():
        reference = measure_reference()  # near in time, since the machine's speed varies
        rounds = [measure(words) for _ in range(ROUNDS)]
        took, cpu = (min(column) for column in zip(*rounds, strict=True))
        reference = min(reference, measure_reference())
        print(f"{name:36} {took:6.2f} {cpu:6.2f} {cpu / reference:10.1f}", flush=True)


if __name__ == "__main__":
    with stated():
        main()
