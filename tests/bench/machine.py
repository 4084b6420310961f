"""Measure how fast this machine is, so that figures of different machines can be compared.

A bench prints CPU seconds beside seconds. It also prints how long a fixed piece of work of another
library takes on the same machine at the same time: the reference kernel. The ratio of both depends
little on the machine and on what else runs there.
"""

import functools
import os
import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from scipy import ndimage

SHAPE, SIGMA, ROUNDS = (64, 256, 256), 1.0, 5  # of the reference kernel: voxels (z, y, x), voxels


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
    """Print the machine's speed and load before and after a bench, and the bench's CPU seconds.

    The seconds include child processes that have ended.
    """
    print(_describe(), flush=True)
    start = time.perf_counter()
    try:
        yield
    finally:
        cpu = sum(os.times()[:4])
        print(f"{time.perf_counter() - start:.1f} s, {cpu:.1f} s of CPU; {_describe()}", flush=True)


def _describe() -> str:
    return f"reference kernel {measure_reference():.3f} s of CPU, load {load():.1f}"


def load() -> float:
    """Return the average number of processes that ran in the last minute; 0 on Windows."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0


@functools.cache
def _reference_voxels() -> np.ndarray:
    return np.random.default_rng(0).random(SHAPE, np.float32)
