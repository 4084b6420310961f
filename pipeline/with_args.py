"""Run a command after replacing its word `ARGS` by the words of the environment variable ARGS.

The Makefile uses this. The variable is split like a shell command, with quotes, but no part of it
is run.
"""

import os
import shlex
import sys


def main(command: list[str]) -> None:
    """Replace this process by the command, with the variable's words in place of `ARGS`."""
    text = os.environ.get("ARGS", "")
    try:
        words = shlex.split(text)
    except ValueError as error:
        sys.exit(f"make: ARGS is {text} ({error}), expected words as in a shell")
    place = command.index("ARGS")
    os.execvp(command[0], [*command[:place], *words, *command[place + 1 :]])


if __name__ == "__main__":
    main(sys.argv[1:])
