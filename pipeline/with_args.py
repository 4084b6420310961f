"""Run a command, with the words of the variable ARGS in place of its first word `ARGS`.

For the Makefile: ARGS is split as a shell splits it, quotes and all, but nothing in it is run.
"""

import os
import shlex
import sys


def main(command: list[str]) -> None:
    """Become the command, its word `ARGS` replaced by the words of the variable."""
    text = os.environ.get("ARGS", "")
    try:
        words = shlex.split(text)
    except ValueError as error:
        sys.exit(f"make: ARGS is {text}: {error}, expected words as in a shell")
    place = command.index("ARGS")
    os.execvp(command[0], [*command[:place], *words, *command[place + 1 :]])


if __name__ == "__main__":
    main(sys.argv[1:])
