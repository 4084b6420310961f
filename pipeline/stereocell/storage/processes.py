"""Other processes of this machine, and what there is for them."""

import hashlib
import os
import socket
from contextlib import suppress
from pathlib import Path


def cores() -> int:
    """Return how many cores this process may use: by its affinity, and by its container's quota."""
    from dask.system import cpu_count  # takes a while, and most commands don't ask

    return int(cpu_count())


def available_bytes() -> int:
    """Return the memory that is free to use, of the machine or of the container."""
    import psutil
    from distributed.system import memory_limit

    return int(min(psutil.virtual_memory().available, memory_limit()))


def machine() -> str:
    """Return 8 hexadecimal digits for where a process's id means something: this machine, or this
    container, since it was started. Others may have its name, and a container's host its start."""
    place = socket.gethostname()
    with suppress(OSError):  # Linux has them
        place += Path("/proc/sys/kernel/random/boot_id").read_text()
        place += os.readlink("/proc/self/ns/pid")
    return hashlib.sha256(place.encode()).hexdigest()[:8]


def start_of(process: int) -> str:
    """Return what tells a running process of this machine from all that had or will have its id.

    Empty: it can't be seen, or there is none.
    """
    import psutil

    with suppress(OSError, psutil.Error):
        if not Path("/proc/self/stat").exists():
            return str(psutil.Process(process).create_time())
        # what psutil returns moves with the clock on Linux: ticks since the machine's start don't
        state, *fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        return "ended" if state in "ZX" else fields[18]
    return ""


def is_alive(process: int, start: str = "") -> bool:
    """Return whether a process of that id runs, and where its start is known: that very one."""
    import psutil

    now = start_of(process)
    return psutil.pid_exists(process) and (not start or not now or now == start)
