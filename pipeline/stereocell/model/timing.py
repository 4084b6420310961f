"""A clock that adds up the seconds that each named part of the work takes."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Clock:
    """A clock that adds up the seconds of each part of the work: `with clock("extract"): ...`."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, step: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.seconds[step] = self.seconds.get(step, 0.0) + time.perf_counter() - start
