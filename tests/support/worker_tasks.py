"""Tasks for worker processes, which import them by name."""

import os
import time
from pathlib import Path

import numpy as np
import psutil

from stereocell.model.errors import SourceError

kept: list[np.ndarray] = []  # arrays that stay in a worker after its task


def double(value: int) -> int:
    if value in (3, 6):
        raise SourceError("it is\nbroken")
    if value == 4:
        raise ValueError("four is a bug")
    return 2 * value


def die(value: int) -> int:
    if value == 1:
        os._exit(9)  # as if the system killed the process for want of memory
    return value


def read_variable(name: str) -> str | None:
    return os.environ.get(name)


def die_beside_others(task: tuple[Path, int]) -> int:
    """Kill this process at task 3, the first time that it runs."""
    folder, number = task
    died = folder / "died"
    if number == 3 and not died.exists():
        died.write_text(str(number))
        os._exit(9)
    return number


class Unpicklable(Exception):
    """An error whose pickled form can't be read back, because its class needs two arguments."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(f"{first} {second}")


def fail_unpicklably(_: int) -> None:
    raise Unpicklable("it has", "two arguments")


def wait_for_ever(begun: Path) -> None:
    begun.touch()
    while True:
        time.sleep(60)


def write_for_ever(file: Path) -> None:
    """Finish one file, then wait for ever in the middle of another file and a folder."""
    from stereocell.storage.atomic_write import replacing, replacing_folder, write_bytes

    write_bytes(file.with_name(f"{file.name}.whole"), b"finished")
    with replacing_folder(file.with_name(f"{file.name}.folder")) as folder:
        (folder / "part").write_bytes(b"half")
        with replacing(file) as half:
            half.write_bytes(b"half")
            wait_for_ever(file.with_name(f"{file.name}.begun"))


def free_much(_: int) -> int:
    """Fill and free 640 MB. Return the bytes of memory that this process held before."""
    before = psutil.Process().memory_info().rss
    arrays = [np.ones(8_000_000) for _ in range(10)]
    kept.append(np.ones(1000))  # lies above the freed arrays, at the end of the heap
    del arrays
    return int(before)
