"""The worker processes of a running command, however they were started."""

import psutil

_SERVER = "multiprocessing.forkserver"  # in the command lines of the server and its forks


def workers_of(command: psutil.Process) -> list[psutil.Process]:
    """Return the processes that run a command's tasks. Raises psutil.Error if one has ended."""
    return [one for one in command.children(recursive=True) if _is_worker(one)]


def _is_worker(process: psutil.Process) -> bool:
    line = " ".join(process.cmdline())
    if "spawn_main" in line:
        return True
    parent = process.parent()
    return _SERVER in line and parent is not None and _SERVER in " ".join(parent.cmdline())
