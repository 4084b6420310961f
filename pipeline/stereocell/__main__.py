"""The command `stereocell`, as `python -m stereocell`."""

import sys

from stereocell.cli.__main__ import main

if __name__ == "__main__":
    sys.exit(main())
