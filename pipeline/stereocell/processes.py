"""Other processes of this machine, and what there is for them."""

import hashlib
import os
import socket
from contextlib import suppress


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
    container, whose processes have ids of their own and whose name others may have, too."""
    place = socket.gethostname()
    with suppress(OSError):  # Linux has it
        place += os.readlink("/proc/self/ns/pid")
    return hashlib.sha256(place.encode()).hexdigest()[:8]


def is_alive(process: int) -> bool:
    """Return whether a process of that id runs; elsewhere than on POSIX it is taken to."""
    if os.name != "posix":  # os.kill asks nothing there, it kills
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # somebody else's
        pass
    return True
