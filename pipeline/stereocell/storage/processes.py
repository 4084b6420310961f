"""Look up other processes of this machine, and the resources that this process may use."""

import ctypes
import errno
import hashlib
import math
import os
import re
import socket
import sys
from contextlib import suppress
from pathlib import Path

from stereocell.model.errors import StereoCellError

# Bytes of address space, measured on 2 cores. With less, OpenBLAS stops, and USD crashes while it
# writes a stage.
_MIN_FREE, _MIN_FOR_STAGE, _MIN_PER_CORE = 1.5e9, 2.9e9, 0.15e9
_STAGE_WRITERS = ("build", "stage", "tissue")
_SIGNS = re.compile(
    r"can't start new thread|resource temporarily unavailable|cannot allocate memory|"
    r"failed to map segment|bad_alloc|thread constructor failed|unable to allocate|"
    r"insufficient memory|not enough memory|out of memory",
    re.IGNORECASE,
)
_M_TRIM_THRESHOLD, _M_MMAP_MAX = -1, -4  # parameters of glibc's `mallopt`
KEPT_BYTES = 600e6  # resident memory up to which a process keeps what it has freed


def keep_freed_memory() -> None:
    """Let this process keep the memory that it frees, for its next arrays.

    By default glibc returns each large array to the system. Linux then clears every page again when
    the next array is filled, which takes about a tenth of a build's CPU time. The peak of the
    memory grows by a few percent. A larger threshold is not enough: glibc allows at most 32 MB, and
    a tile's arrays have 200. Other C libraries lack these settings, and nothing changes there. See
    also `release_freed_memory`.

    Reference: https://www.gnu.org/software/libc/manual/html_node/Malloc-Tunable-Parameters.html
    """
    if sys.platform != "linux":
        return
    libc = ctypes.CDLL(None)
    if hasattr(libc, "mallopt"):
        libc.mallopt(_M_MMAP_MAX, 0)
        libc.mallopt(_M_TRIM_THRESHOLD, -1)


def release_freed_memory() -> None:
    """Return to the system what `keep_freed_memory` has kept, if the process holds much memory.

    After a task of a build this is up to a gigabyte. The arrays of another kind of task have other
    sizes, so they would not fit into all of it, and the peak of the memory would grow. A process
    with less than KEPT_BYTES keeps its memory, because Linux would clear it again for the next
    task: a twelfth of the CPU time of a build of small tiles.
    """
    if sys.platform != "linux" or not hasattr(libc := ctypes.CDLL(None), "malloc_trim"):
        return
    try:
        pages = int(Path("/proc/self/statm").read_text("utf-8").split()[1])
    except OSError:  # /proc is missing, or no file can be opened
        return
    if pages * os.sysconf("SC_PAGE_SIZE") > KEPT_BYTES:
        libc.malloc_trim(0)


def cores() -> int:
    """Return the number of cores for this process, by its affinity and its container's quota."""
    # counts like `dask.system.cpu_count`, whose import takes 0.2 s
    if hasattr(os, "sched_getaffinity"):
        found = len(os.sched_getaffinity(0))
    else:
        import psutil

        process = psutil.Process()  # macOS has no affinity
        affinity = process.cpu_affinity() if hasattr(process, "cpu_affinity") else None
        found = len(affinity or ()) or os.cpu_count() or 1
    return max(1, math.ceil(min(found, container_cores())))


def container_cores(root: Path = Path("/")) -> float:
    """Return the cores that the container may use, which may be a fraction; infinity: no limit.

    root  root of the file system

    References: https://docs.kernel.org/admin-guide/cgroup-v2.html, `cpu.max`. Version 1 has
    `cpu.cfs_quota_us`, which is negative without a limit.
    """
    for folder in ("cpuacct,cpu", "cpu,cpuacct"):
        first = root / "sys/fs/cgroup" / folder
        with suppress(OSError, ValueError, ZeroDivisionError):
            quota = int((first / "cpu.cfs_quota_us").read_text("ascii"))
            share = quota / int((first / "cpu.cfs_period_us").read_text("ascii"))
            return share if share > 0 else math.inf
    with suppress(OSError, ValueError, ZeroDivisionError):
        group = (root / "proc/self/cgroup").read_text("ascii").strip().rpartition(":")[2].strip("/")
        words = (root / "sys/fs/cgroup" / group / "cpu.max").read_text("ascii").split()
        quota, period = map(int, words)  # ValueError for `max`, which means no limit
        return quota / period if quota > 0 else math.inf
    return math.inf


def available_bytes() -> int:
    """Return the free memory in bytes, of the machine or of the container."""
    import psutil

    return int(min(psutil.virtual_memory().available, container_bytes()))


def container_bytes(root: Path = Path("/")) -> float:
    """Return the bytes of memory that the container may use; infinity: no limit.

    root  root of the file system

    `distributed.system.memory_limit` finds the same, but its import takes half a second. It also
    counts limits that bound nothing: `memory.low` and the soft limit of version 1, which protect
    memory of the group, and RLIMIT_RSS, which Linux ignores.
    """
    found = []
    for name in ("memory.max", "memory.high", "memory/memory.limit_in_bytes"):  # last: version 1
        with suppress(OSError, ValueError):  # ValueError for `max`, which means no limit
            found.append(int((root / "sys/fs/cgroup" / name).read_text("ascii")))
    return min(found, default=math.inf)


def address_limit() -> float:
    """Return the bytes of address space that this process may use (`ulimit -v`), or infinity."""
    try:
        import resource  # Windows lacks it
    except ImportError:
        return math.inf
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    return math.inf if soft == resource.RLIM_INFINITY else soft


def require_address_space(command: str) -> None:
    """Raise StereoCellError if libraries would crash for lack of address space.

    They need it for their code, and for a stack and a heap of one thread for each core. Voxels come
    on top.
    """
    least = _MIN_FOR_STAGE if command in _STAGE_WRITERS else _MIN_FREE
    least += _MIN_PER_CORE * (os.cpu_count() or 1)
    if address_limit() < least:
        raise StereoCellError(
            f"memory: {_allowed()}; `{command}` needs at least {least / 1e9:.1f} GB, and more for "
            "voxels: raise the limit, for example by `ulimit -v unlimited`"
        )


def shortage(error: BaseException) -> str:
    """Return a line for an error that a lack of memory caused; empty: it has another cause.

    The causes of the error are searched, too. Threads, processes and shared libraries that lack
    memory raise errors of their own.
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
    """Return 8 hexadecimal digits that identify this machine or container since its start.

    Process IDs are unique within it. The host name is not enough, because another machine may have
    the same. The boot ID is not enough, because a container has that of its host.
    """
    place = socket.gethostname()
    with suppress(OSError):  # Linux has both files
        place += Path("/proc/sys/kernel/random/boot_id").read_text("utf-8")
        place += os.readlink("/proc/self/ns/pid")
    return hashlib.sha256(place.encode()).hexdigest()[:8]


def start_of(process: int) -> str:
    """Return a mark that distinguishes a process of this machine from others with the same ID.

    Empty: the mark can't be read, or there is no such process.
    """
    import psutil

    with suppress(OSError, psutil.Error):
        if not Path("/proc/self/stat").exists():
            return str(psutil.Process(process).create_time())
        # On Linux psutil's value shifts with the clock. Ticks since the machine's start don't.
        stat = Path(f"/proc/{process}/stat").read_text("utf-8", "replace")
        state, *fields = stat.rpartition(")")[2].split()
        return "ended" if state in "ZX" else fields[18]
    return ""


def is_alive(process: int, *, start: str = "") -> bool:
    """Return whether a process with this ID runs.

    start  mark of its start, to tell it from a later process with the same ID; empty: not known
    """
    import psutil

    now = start_of(process)
    return psutil.pid_exists(process) and (not start or not now or now == start)
