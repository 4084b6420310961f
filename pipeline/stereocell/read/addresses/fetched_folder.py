"""Folders for files that are fetched for one command: their owner's alone, and removed at its end.

`tempfile.mkdtemp` makes a folder that nobody else can enter. Its name holds nothing of the address.
"""

import atexit
import os
import shutil
import tempfile
from pathlib import Path


def new_folder(name: str) -> Path:
    """Return a new, empty folder of this name, which is removed when this process ends."""
    outer = Path(tempfile.mkdtemp(prefix="stereocell-fetched-"))
    atexit.register(_remove, outer, os.getpid())
    folder = outer / name
    folder.mkdir(mode=0o700)
    return folder


def remove(folder: Path) -> None:
    """Remove a folder of `new_folder` at once, since fetching it has failed."""
    _remove(folder.parent, os.getpid())


def _remove(outer: Path, owner: int) -> None:
    if os.getpid() == owner:  # no process that was forked meanwhile
        shutil.rmtree(outer, ignore_errors=True)
