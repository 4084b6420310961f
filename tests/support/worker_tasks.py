"""Tasks for worker processes, which import them by name."""

import os

from stereocell.model.errors import SourceError


def double(value: int) -> int:
    if value in (3, 6):
        raise SourceError("it is\nbroken")
    if value == 4:
        raise ValueError("four is a bug")
    return 2 * value


def die(value: int) -> int:
    if value == 1:
        os._exit(9)  # as when the system takes a process's memory back
    return value


def read_variable(name: str) -> str | None:
    return os.environ.get(name)
