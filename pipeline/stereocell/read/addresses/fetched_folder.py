"""Folders for files that are fetched for one command, private and removed when it ends.

`tempfile.mkdtemp` makes a folder that nobody else can enter, with a name that contains nothing of
the address. A process that is killed leaves its folder behind. The system's lock (flock) on a file
in it ends with the process, so the next command notices and removes the folder. Windows has no
flock: there such a folder stays.
"""

import atexit
import os
import shutil
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

if sys.platform != "win32":
    import fcntl

_PREFIX = "stereocell-fetched-"
_LOCK = ".lock"


def new_folder(name: str) -> Path:
    """Create an empty folder with this name and return it. It is removed when this process ends."""
    _remove_abandoned()
    outer = Path(tempfile.mkdtemp(prefix=_PREFIX))
    atexit.register(_remove, outer, os.getpid())
    _hold(outer)
    folder = outer / name
    folder.mkdir(mode=0o700)
    return folder


def remove(folder: Path) -> None:
    """Remove a folder of `new_folder` at once, because fetching has failed."""
    _remove(folder.parent, os.getpid())


def _remove(outer: Path, owner: int) -> None:
    if os.getpid() == owner:  # a forked process must not remove it
        shutil.rmtree(outer, ignore_errors=True)


def _hold(outer: Path) -> None:
    """Lock a folder until this process ends."""
    if sys.platform == "win32":
        return
    part = outer / f"{_LOCK}.part"
    # the file stays open, and so locked, until the process ends
    file = os.open(part, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    fcntl.flock(file, fcntl.LOCK_EX)
    # Renamed only once it is locked: other commands remove a folder whose lock file isn't locked.
    part.rename(outer / _LOCK)


def _remove_abandoned() -> None:
    """Remove folders that killed processes of this user left behind."""
    if sys.platform == "win32":
        return
    for outer in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
        with suppress(OSError):  # another command may remove it too, or it belongs to another user
            if outer.is_symlink() or outer.stat().st_uid != os.getuid():
                continue
            file = os.open(outer / _LOCK, os.O_RDWR | os.O_NOFOLLOW)
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(outer, ignore_errors=True)
            finally:
                os.close(file)
