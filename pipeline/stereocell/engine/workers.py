"""Worker processes of this machine, forked from a server that has imported what they need.

A process that starts from nothing imports for 1.7 s of CPU. The server imports once for all
workers of a command; they share its memory until they write. It has no threads, so that it can
fork. Workers start from nothing where the system has no such server (Windows; macOS, whose
libraries don't bear a fork), where it can't have its socket (a folder of temporary files with a
long name, or a full one), and where the environment is another one than the server's.
"""

import os
import sys
from collections.abc import Callable
from typing import Any

_METHOD = "distributed.worker.multiprocessing-method"
_environment: dict[str, str] = {}  # of the server; empty: there is none yet


def choose_start(function: Callable[..., Any]) -> None:
    """Choose how distributed starts workers; start the server where it is to be used.

    function  the first task: the server imports its module
    """
    import dask

    way = "forkserver" if sys.platform == "linux" and _has_server(function) else "spawn"
    dask.config.set({_METHOD: way})


def _has_server(function: Callable[..., Any]) -> bool:
    """Return whether workers can be forked from a server; it is started where there is none."""
    from multiprocessing import forkserver  # not for Windows

    import dask
    from distributed.utils import get_mp_context

    if _environment:
        return _environment == dict(os.environ)
    with dask.config.set({_METHOD: "forkserver"}):
        context = get_mp_context()  # which names modules to preload, and so comes first
    context.set_forkserver_preload(["distributed", "distributed.nanny", function.__module__])
    try:
        forkserver.ensure_running()
    except OSError:
        return False
    _environment.update(os.environ)
    return True
