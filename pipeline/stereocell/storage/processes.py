"""Other processes of this machine, and its resources for this one."""

import errno
import hashlib
import math
import os
import re
import socket
from contextlib import suppress
from pathlib import Path

from stereocell.model.errors import StereoCellError

# bytes of address space; measured on 2 cores: below, OpenBLAS gives up, and USD (stage) crashes
_MIN_FREE, _MIN_FOR_STAGE, _MIN_PER_CORE = 1.5e9, 2.9e9, 0.15e9
_STAGE_WRITERS = ("build", "stage", "tissue")
_SIGNS = re.compile(
    r"can't start new thread|resource temporarily unavailable|cannot allocate memory|"
    r"failed to map segment|bad_alloc|thread constructor failed|unable to allocate|"
    r"insufficient memory|not enough memory|out of memory",
    re.IGNORECASE,
)


def cores() -> int:
    """Return the number of cores for this process, by its affinity and its container's quota."""
    from dask.system import cpu_count  # slow to import, and most commands don't need it

    return int(cpu_count())


def available_bytes() -> int:
    """Return the free memory in bytes, of the machine or of the container."""
    import psutil
    from distributed.system import memory_limit

    return int(min(psutil.virtual_memory().available, memory_limit()))


def address_limit() -> float:
    """Return the bytes of address space that this process may use (`ulimit -v`), or infinity."""
    try:
        import resource  # Windows lacks it
    except ImportError:
        return math.inf
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    return math.inf if soft == resource.RLIM_INFINITY else soft


def require_address_space(command: str) -> None:
    """Raise StereoCellError where libraries would crash for lack of address space.

    The need is that before any voxel: their code, and a stack and a heap for a thread of each core.
    """
    least = _MIN_FOR_STAGE if command in _STAGE_WRITERS else _MIN_FREE
    least += _MIN_PER_CORE * (os.cpu_count() or 1)
    if address_limit() < least:
        raise StereoCellError(
            f"memory: {_allowed()}; `{command}` needs at least {least / 1e9:.1f} GB, and more for "
            "voxels: raise the limit, as by `ulimit -v unlimited`"
        )


def shortage(error: BaseException) -> str:
    """Return a line for an error that a lack of memory caused, itself or by its cause; else "".

    A lack of memory for threads, processes and shared libraries has errors of its own.
    """
    seen: BaseException | None = error
    while seen is not None:
        text = str(seen)
        if (
            isinstance(seen, MemoryError)
            or (isinstance(seen, OSError) and seen.errno == errno.ENOMEM)
            or (isinstance(seen, RuntimeError | ImportError | OSError) and _SIGNS.search(text))
        ):
            limit = f"; {_allowed()}: raise the limit" if address_limit() < math.inf else ""
            message = " ".join(text.split())[:160] or type(seen).__name__
            return f"out of memory ({message}): try fewer --workers or a smaller --tile-size{limit}"
        seen = seen.__cause__ or seen.__context__
    return ""


def _allowed() -> str:
    return f"{address_limit() / 1e9:.1f} GB of address space are allowed here (`ulimit -v`)"


def machine() -> str:
    """Return 8 hexadecimal digits that identify the scope of process IDs: this machine or container
    since its start. Another machine may have the same host name, a container its host's boot ID."""
    place = socket.gethostname()
    with suppress(OSError):  # Linux has both files
        place += Path("/proc/sys/kernel/random/boot_id").read_text("utf-8")
        place += os.readlink("/proc/self/ns/pid")
    return hashlib.sha256(place.encode()).hexdigest()[:8]


def start_of(process: int) -> str:
    """Return a mark that distinguishes a process of this machine from others with the same ID.

    Empty: it can't be read, or there is no such process.
    """
    import psutil

    with suppress(OSError, psutil.Error):
        if not Path("/proc/self/stat").exists():
            return str(psutil.Process(process).create_time())
        # on Linux psutil's value shifts with the clock; ticks since the machine's start don't
        stat = Path(f"/proc/{process}/stat").read_text("utf-8", "replace")  # with its name
        state, *fields = stat.rpartition(")")[2].split()
        return "ended" if state in "ZX" else fields[18]
    return ""


def is_alive(process: int, *, start: str = "") -> bool:
    """Return whether a process with this ID runs and, where its start is known, is the same."""
    import psutil

    now = start_of(process)
    return psutil.pid_exists(process) and (not start or not now or now == start)
