"""Let only one command at a time write into an OUT; a second one gets an error.

OUT/.lock is held by the system's own lock (flock), which always ends with its process. So the next
command takes over a stale file, and a reused process ID can't mislead it. The file's content is for
people only. On NFS the lock works between machines (since Linux 2.6.12). Windows has no flock:
there the file only informs people, and no command is refused.
"""

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from stereocell.model.errors import OutputError

if sys.platform != "win32":
    import fcntl
from stereocell.storage.claim import LOCK, Claim, describe, holding, in_words
from stereocell.storage.temporary_names import clear_remains


@contextmanager
def alone_in(out: Path, command: str) -> Iterator[None]:
    """Hold OUT for a command that writes into it. A folder that stays empty is removed.

    Partial files are removed if the block fails or is interrupted, or if the previous holder was
    killed: Ctrl+C ends workers at once, in the middle of a file. Finished results stay.

    Raises OutputError if another process holds OUT (the text names it), or if OUT can't be written.
    """
    made = _missing_folders(out)
    try:
        try:
            out.mkdir(parents=True, exist_ok=True)
            file, was_killed = _hold(out / LOCK, command)
        except OSError as error:
            raise OutputError(
                f"{out}: can't be written ({error.strerror}), expected a folder of your own"
            ) from None
        try:
            if was_killed:
                clear_remains(out)
            with holding(Claim((out / LOCK).absolute(), (out / LOCK).read_bytes())):
                yield
        except BaseException:
            with suppress(OSError):  # the error of the block matters more
                clear_remains(out)
            raise
        finally:
            if sys.platform == "win32":  # Windows can't remove an open file
                os.close(file)
            with suppress(OSError):  # if OUT isn't writable, the next command takes the lock over
                (out / LOCK).unlink(missing_ok=True)  # before closing, so that nobody else holds it
            if sys.platform != "win32":
                os.close(file)
    finally:
        for folder in made:
            with suppress(OSError):  # the folder has content
                folder.rmdir()


def _missing_folders(out: Path) -> list[Path]:
    """Return OUT and the folders above it that don't exist, the innermost first."""
    return [folder for folder in (out, *out.parents) if not folder.exists()]


def _hold(path: Path, command: str) -> tuple[int, bool]:
    """Acquire the lock; return its open file, and whether its previous holder was killed."""
    while True:
        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            if sys.platform != "win32":
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            owner = _owner(file)
            os.close(file)
            raise OutputError(
                f"{path.parent}: {owner} is writing here: wait until it has ended"
            ) from None
        # if the previous holder has removed the file in the meantime, try again
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file), path.stat()):
                break
        os.close(file)
    was_killed = os.fstat(file).st_size > 0
    with suppress(OSError):  # a full disk: the lock works without its content, which people read
        os.ftruncate(file, 0)
        os.write(file, json.dumps(describe(command)).encode())
    return file, was_killed


def _owner(file: int) -> str:
    os.lseek(file, 0, os.SEEK_SET)
    return in_words(os.read(file, 4096))
