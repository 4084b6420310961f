"""How kernels are compiled: by numba, once for each machine and version, without fast math.

A kernel is a function of arrays and numbers that loops over voxels, vertices or triangles, where
array expressions would take several times the time and memory. It runs in one thread and rounds by
IEEE 754. No operations are fused or reordered, so a result has the same bytes on processors with
other vector units. A kernel's decisions never depend on functions whose last bit depends on the C
library (cosines, logarithms).
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numba.extending import register_jitable

from stereocell.kernels.cache_place import cache_folder

F = TypeVar("F", bound=Callable[..., Any])

_CONFIG: Any = numba.config
# Without this option, wrappers for C programs would be compiled that are never called.
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
# Python never calls compiled parts of kernels, so they get no wrapper for its objects either.
_INNER: dict[str, Any] = {**_OPTIONS, "forceinline": True, "no_cpython_wrapper": True}


def kernel(function: F) -> F:
    """Compile a function at its first call, or take it from the cache."""
    return _cached(numba.njit(**_OPTIONS)(function), function)


def in_place(function: F) -> F:
    """Compile a kernel that creates no array, so that numba need not count references to arrays.

    Its arrays may come in a NamedTuple. numba would otherwise count each access to one by atomic
    operations, and the collapse would take twice the time.
    """
    return _cached(numba.njit(_nrt=False, **_OPTIONS)(function), function)


def step(function: F) -> F:
    """Compile a small function into each kernel that calls it, with the options of `in_place`."""
    return register_jitable(_nrt=False, **_INNER)(function)


def _cached(compiled: Any, function: F) -> F:
    folder = cache_folder(function.__module__)
    if folder is not None:
        past = _CONFIG.CACHE_DIR
        _CONFIG.CACHE_DIR = str(folder)
        try:
            compiled.enable_caching()
        finally:
            _CONFIG.CACHE_DIR = past
    return compiled


def part(function: F) -> F:
    """Compile a small function into each kernel that calls it."""
    return register_jitable(**_INNER)(function)
