"""Objects and functions that tests run in a child process (storage/child_process.py)."""

import os
import signal
import time
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError

LONG_S = 600.0  # longer than any test waits


class Counter:
    def __init__(self, start: int) -> None:
        self.count = start

    def add(self, number: int) -> int:
        self.count += number
        return self.count

    def doubled(self, values: NDArray[np.int64]) -> NDArray[np.int64]:
        return 2 * values

    def kill(self) -> None:
        os.kill(os.getpid(), signal.SIGSEGV)

    def sleep(self) -> None:
        time.sleep(LONG_S)

    def process(self) -> int:
        return os.getpid()


def refuse(text: str) -> NoReturn:
    raise SourceError(text)


def print_and_return() -> int:
    os.write(1, b"a library prints")
    os.write(2, b"a library warns")
    return 3
