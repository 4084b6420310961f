"""Time the start of commands, beside a Python that does nothing.

Each command ends early, after `--help` or because its input is missing. Prints the least time and
the medians of ROUNDS processes; bytecode and files are in the system's cache.
"""

import subprocess
import sys

from machine import stated, timed, typical

from support.missing_inputs import MISSING_INPUTS

ROUNDS = 7
MISSING = ", input missing"  # ends the names of commands that exit with 1
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
        f"{name}{MISSING}": ["-m", "stereocell.cli", *words]
        for name, words in MISSING_INPUTS.items()
    },
}


def main() -> None:
    for name, words in PROGRAMS.items():
        rounds = []
        for _ in range(ROUNDS):
            with timed() as spent:
                ended = subprocess.run([sys.executable, *words], capture_output=True, text=True)
            if ended.returncode != name.endswith(MISSING):
                raise SystemExit(f"{name}: exit {ended.returncode}: {ended.stderr[-2000:]}")
            rounds.append(spent)
        least = min(spent.seconds for spent in rounds)
        print(f"{name:36} least {least:.2f} s, medians {typical(*rounds)}")


if __name__ == "__main__":
    with stated():
        main()
