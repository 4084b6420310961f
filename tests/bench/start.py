"""Time `import stereocell` and `stereocell --help`, beside a Python that does nothing.

Prints minimum and median of ROUNDS processes; bytecode and files are in the system's cache.
"""

import statistics
import subprocess
import sys
import time

from machine import stated

ROUNDS = 15
PROGRAMS = {
    "python": ["-c", ""],
    "import stereocell": ["-c", "import stereocell"],
    "stereocell --help": ["-m", "stereocell.cli", "--help"],
    "stereocell build --help": ["-m", "stereocell.cli", "build", "--help"],
    "import stereocell; stereocell.build": ["-c", "import stereocell; stereocell.build"],
}


def main() -> None:
    for name, words in PROGRAMS.items():
        took = []
        for _ in range(ROUNDS):
            start = time.perf_counter()
            subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
            took.append(1000 * (time.perf_counter() - start))
        print(f"{name:36} least {min(took):4.0f} ms, median {statistics.median(took):4.0f} ms")


if __name__ == "__main__":
    with stated():
        main()
