"""Other processes of this machine, and what there is for them."""

import os


def cores() -> int:
    """Return how many cores this process may use: by its affinity, and by its container's quota."""
    from dask.system import cpu_count  # takes a while, and most commands don't ask

    return int(cpu_count())


def available_bytes() -> int:
    """Return the memory that is free to use, of the machine or of the container."""
    import psutil
    from distributed.system import memory_limit

    return int(min(psutil.virtual_memory().available, memory_limit()))


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
