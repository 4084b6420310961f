"""Measure how fast this machine is, so that figures of different machines can be compared.

A bench prints CPU seconds beside seconds. It also prints how long a fixed piece of work of another
library takes on the same machine at the same time: the reference kernel. The ratio of both depends
little on the machine and on what else runs there.
"""

import functools
import math
import os
import statistics
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

SHAPE, SIGMA, ROUNDS = (64, 256, 256), 1.0, 5  # of the reference kernel: voxels (z, y, x), voxels


@dataclass
class Spent:
    """Time that a piece of work took.

    seconds    time from start to end
    cpu        CPU seconds, with those of child processes that have ended
    reference  CPU seconds of the reference kernel at about the same time; 0 if not measured
    load       average number of processes that ran meanwhile
    """

    seconds: float = 0.0
    cpu: float = 0.0
    reference: float = 0.0
    load: float = 0.0

    @property
    def references(self) -> float:
        """Return the CPU seconds in units of the reference kernel."""
        return self.cpu / self.reference

    def passes(self, shape: tuple[int, int, int]) -> float:
        """Return the CPU seconds in units of the reference kernel over a volume of this shape."""
        return self.references * math.prod(SHAPE) / math.prod(shape)

    def __str__(self) -> str:
        return (
            f"{self.seconds:8.2f} s {self.cpu:8.2f} s of CPU, {self.references:7.1f} references "
            f"of {self.reference:.3f} s   load {self.load:.1f}"
        )


@contextmanager
def timed() -> Iterator[Spent]:
    """Yield the seconds and CPU seconds of a block, which are known after its end."""
    spent, start, cpu = Spent(), time.perf_counter(), _cpu()
    try:
        yield spent
    finally:
        spent.seconds, spent.cpu = time.perf_counter() - start, _cpu() - cpu


def typical(*rounds: Spent) -> Spent:
    """Return the medians of several rounds, with the machine's speed and load now."""
    return Spent(
        statistics.median(one.seconds for one in rounds),
        statistics.median(one.cpu for one in rounds),
        measure_reference(),
        load(),
    )


def range_of(costs: Sequence[Spent]) -> str:
    """Return the times of the reference kernel beside some figures, and the loads."""
    times, loads = [one.reference for one in costs], [one.load for one in costs]
    return (
        f"reference kernel {min(times):.3f} to {max(times):.3f} s, "
        f"load {min(loads):.1f} to {max(loads):.1f}"
    )


def measure_reference() -> float:
    """Return the CPU seconds of the reference kernel now: scipy's Gaussian filter, one thread.

    The result is the median of several rounds.
    """
    voxels = _reference_voxels()
    spent = []
    for _ in range(ROUNDS):
        start = time.process_time()
        ndimage.gaussian_filter(voxels, SIGMA)
        spent.append(time.process_time() - start)
    return statistics.median(spent)


@contextmanager
def stated() -> Iterator[None]:
    """Print the machine's speed and load before a bench, and afterwards what the bench took."""
    print(f"reference kernel {measure_reference():.3f} s of CPU, load {load():.1f}", flush=True)
    whole = Spent()
    try:
        with timed() as whole:
            yield
    finally:
        print(f"the whole bench: {str(typical(whole)).strip()}", flush=True)


def load() -> float:
    """Return the average number of processes that ran in the last minute; 0 on Windows."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0


def _cpu() -> float:
    return time.process_time() + sum(os.times()[2:4])


@functools.cache
def _reference_voxels() -> np.ndarray:
    return np.random.default_rng(0).random(SHAPE, np.float32)
