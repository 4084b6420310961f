"""Hide from StereoCell what Windows lacks, in processes with this folder on PYTHONPATH.

StereoCell's modules see the platform `win32` and only the parts of the standard library that
Windows has. Other modules see this system. At and below the current folder, files must keep to
Windows' rules: a name must be allowed, and an open file and its folders can be neither removed nor
moved. Text files must be opened with an encoding, because the default differs on Windows.
"""

import builtins
import os
import signal
import socket
import sys
import warnings
from pathlib import Path, PureWindowsPath
from types import ModuleType
from typing import Any

MODULES = {
    *("fcntl", "resource", "pwd", "grp", "termios", "tty", "pty", "posix", "syslog", "readline"),
    *("curses", "crypt", "spwd", "multiprocessing.popen_fork", "multiprocessing.popen_forkserver"),
}
NAMES = {
    "os": {
        *("pread", "preadv", "pwrite", "pwritev", "readv", "writev", "sendfile", "copy_file_range"),
        *("fork", "forkpty", "register_at_fork", "wait", "waitid", "wait3", "wait4", "killpg"),
        *("WNOHANG", "posix_spawn", "posix_spawnp", "setsid", "getsid", "nice", "getpriority"),
        *("getuid", "geteuid", "getgid", "getegid", "getgroups", "setuid", "setgid", "getpgid"),
        *("setpgid", "getpgrp", "setpgrp", "uname", "getloadavg", "sysconf", "confstr", "sync"),
        *("chown", "fchown", "lchown", "chroot", "fchmod", "fchdir", "mkfifo", "mknod", "statvfs"),
        *("fstatvfs", "pathconf", "lockf", "fdatasync", "posix_fadvise", "posix_fallocate"),
        *("sched_getaffinity", "sched_setaffinity", "sched_yield", "getrandom", "memfd_create"),
        *("environb", "getenvb", "ttyname", "openpty", "O_CLOEXEC", "O_DIRECTORY", "O_NOFOLLOW"),
        *("O_NONBLOCK", "O_SYNC", "O_DSYNC", "O_NOCTTY", "O_PATH", "O_TMPFILE", "symlink"),
    },
    "signal": {
        *("SIGKILL", "SIGHUP", "SIGQUIT", "SIGPIPE", "SIGALRM", "SIGCHLD", "SIGUSR1", "SIGUSR2"),
        *("SIGSTOP", "SIGCONT", "SIGTSTP", "SIGWINCH", "SIG_BLOCK", "SIG_UNBLOCK", "SIG_SETMASK"),
        *("pthread_sigmask", "pthread_kill", "sigwait", "sigpending", "alarm", "setitimer"),
        *("siginterrupt", "pause"),
    },
    "socket": {"AF_UNIX", "SO_REUSEPORT", "AF_NETLINK", "AF_PACKET", "sethostname"},
}
RESERVED = {
    "CON",
    "PRN",
    "AUX",
    "NUL",
    *(f"{port}{n}" for port in ("COM", "LPT") for n in range(10)),
}


def fault_of(path: str) -> str:
    """Return why Windows would refuse a relative path, or ""."""
    for name in PureWindowsPath(path).parts if ":" not in path else (path,):
        if any(char in '<>:"|?*\\' or ord(char) < 32 for char in name):
            return f"{name!r} has a character that Windows' names lack"
        if name[-1:] in (".", " ") and name not in (".", ".."):
            return f"{name!r} ends in a dot or a space"
        if name.split(".")[0].rstrip().upper() in RESERVED:
            return f"{name!r} is a device"
    return ""


class _Part(ModuleType):
    """A module without some of its names; other names are looked up in the module each time."""

    def __init__(self, whole: ModuleType, without: set[str], **instead: object) -> None:
        super().__init__(whole.__name__)
        self._whole, self._without = whole, without
        vars(self).update(instead)

    def __getattr__(self, name: str) -> Any:
        if name in self._without:
            raise AttributeError(f"{self.__name__}.{name}: Windows lacks it")
        return getattr(self._whole, name)


_import = builtins.__import__
_parts: dict[str, ModuleType] = {
    "os": _Part(os, NAMES["os"]),
    "signal": _Part(signal, NAMES["signal"]),
    "socket": _Part(socket, NAMES["socket"]),
    "sys": _Part(sys, set(), platform="win32"),
}


def _import_for(
    name: str, globals: Any = None, locals: Any = None, fromlist: Any = (), level: int = 0
) -> Any:
    if level or not str((globals or {}).get("__name__", "")).startswith("stereocell"):
        return _import(name, globals, locals, fromlist, level)
    wanted = {name, *(f"{name}.{one}" for one in fromlist or ())}
    if gone := wanted & MODULES:
        raise ModuleNotFoundError(f"No module named {min(gone)!r}: Windows lacks it")
    found = _import(name, globals, locals, fromlist, level)
    return _parts.get(name, found)


def _without_proc(function: Any) -> Any:
    def wrapped(path: Path, *rest: Any, **options: Any) -> Any:
        caller = sys._getframe(1).f_globals.get("__name__", "")
        # numba finds compiled kernels by cpuinfo; without it, it would compile them again.
        if str(path).startswith("/proc") and path.name != "cpuinfo" and "stereocell" in caller:
            path = Path("no such folder")
        return function(path, *rest, **options)

    return wrapped


def _guard_files(folder: str) -> None:
    """Enforce Windows' rules for files at and below a folder."""

    def inside(path: Any) -> str:
        path = (
            os.path.abspath(os.fsdecode(path))
            if isinstance(path, str | bytes | os.PathLike)
            else ""
        )
        return path if path.startswith(f"{folder}{os.sep}") else ""

    def audit(event: str, values: tuple[Any, ...]) -> None:
        if event in ("open", "os.mkdir", "os.rename", "os.link"):
            made = inside(values[1 if event in ("os.rename", "os.link") else 0])
            if made and (fault := fault_of(made[len(folder) + 1 :])):
                raise OSError(22, f"Windows: {fault}", made)
        if event in ("os.remove", "os.rmdir", "os.rename"):
            for touched in filter(None, map(inside, values[: 2 if event == "os.rename" else 1])):
                if of := [held for held in _open_files() if f"{held}/".startswith(f"{touched}/")]:
                    raise PermissionError(13, f"Windows: {of[0]} is open", touched)

    sys.addaudithook(audit)


def _open_files() -> list[str]:
    found = []
    for number in os.listdir("/proc/self/fd"):
        try:
            found.append(os.readlink(f"/proc/self/fd/{number}"))
        except OSError:  # the descriptor of the list itself, closed by now
            continue
    return found


builtins.__import__ = _import_for
for name in ("read_text", "read_bytes", "exists"):
    setattr(Path, name, _without_proc(getattr(Path, name)))
warnings.filterwarnings("ignore", category=EncodingWarning)  # warnings about libraries
warnings.filterwarnings("error", category=EncodingWarning, module=r"stereocell\b")
_guard_files(os.getcwd())
