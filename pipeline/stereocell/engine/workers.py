"""Worker processes of this machine, forked from a server that has imported what they need.

A process that starts from nothing imports for 1.7 s of CPU. The server imports once for all
workers of a command; they share its memory until they write. It has no threads, so that it can
fork. Where the system has no such server (Windows; macOS, whose libraries don't bear a fork), and
where the environment is another one than the server's, workers start from nothing.
"""

import os
import sys
from collections.abc import Callable
from multiprocessing import forkserver
from typing import Any

_environment: dict[str, str] = {}  # of the server; empty: there is none yet


def choose_start(function: Callable[..., Any]) -> None:
    """Choose how distributed starts workers; start the server where it is to be used.

    function  the first task: the server imports its module
    """
    import dask
    from distributed.utils import get_mp_context

    method = "spawn"
    if sys.platform == "linux" and _environment in ({}, dict(os.environ)):
        method = "forkserver"
    dask.config.set({"distributed.worker.multiprocessing-method": method})
    if method == "forkserver" and not _environment:
        context = get_mp_context()  # which names modules to preload, and so comes first
        context.set_forkserver_preload(["distributed", "distributed.nanny", function.__module__])
        forkserver.ensure_running()
        _environment.update(os.environ)
