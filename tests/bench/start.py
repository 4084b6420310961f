"""Time the imports of a command and `stereocell --help`, beside a Python that does nothing.

Prints the least time and the medians of ROUNDS processes; bytecode and files are in the system's
cache.
"""

import subprocess
import sys

from machine import stated, timed, typical

ROUNDS = 15
PROGRAMS = {
    "python": ["-c", ""],
    "import stereocell": ["-c", "import stereocell"],
    "stereocell --help": ["-m", "stereocell.cli", "--help"],
    "stereocell build --help": ["-m", "stereocell.cli", "build", "--help"],
    "imports of all phases of a build": ["-c", "import stereocell.building.phases"],
    "import stereocell; stereocell.build": ["-c", "import stereocell; stereocell.build"],
}


def main() -> None:
    for name, words in PROGRAMS.items():
        rounds = []
        for _ in range(ROUNDS):
            with timed() as spent:
                subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
            rounds.append(spent)
        least = min(spent.seconds for spent in rounds)
        print(f"{name:36} least {least:.2f} s, medians {typical(*rounds)}")


if __name__ == "__main__":
    with stated():
        main()
