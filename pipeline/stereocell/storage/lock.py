"""One command at a time writes into an OUT; a second one gets an error that names the first.

OUT/.lock is held by the system's own lock (flock), which ends with its process in any case: the
next command takes over a stale file, and a reused process ID can't mislead. The file's content is
for people only. On NFS the lock works between machines (Linux 2.6.12 on). Windows has no flock:
there the file tells people alone, and refuses nobody.
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
    """Hold OUT for a command that writes into it; a folder that stays empty is removed.

    If the block fails or is interrupted, or the previous holder was killed, half-written files are
    removed: Ctrl+C ends workers at once, in the middle of a file. Finished results stay.

    Raises OutputError where another process holds OUT (the text names it), or where OUT can't be
    written.
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
            with suppress(OSError):  # the error of the block is the one to show
                clear_remains(out)
            raise
        finally:
            if sys.platform == "win32":  # it removes no open file
                os.close(file)
            with suppress(OSError):  # OUT isn't writable any more: the next command takes it over
                (out / LOCK).unlink(missing_ok=True)  # while held: no command waits for it
            if sys.platform != "win32":
                os.close(file)
    finally:
        for folder in made:
            with suppress(OSError):  # it has content
                folder.rmdir()


def _missing_folders(out: Path) -> list[Path]:
    """Return OUT and the folders above it that don't exist, the innermost first."""
    return [folder for folder in (out, *out.parents) if not folder.exists()]


def _hold(path: Path, command: str) -> tuple[int, bool]:
    """Return the open lock, and whether its previous holder was killed."""
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
        # the previous holder may have removed the file in between
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file), path.stat()):
                break
        os.close(file)
    was_killed = os.fstat(file).st_size > 0
    with suppress(OSError):  # a full disk: the content is only for people
        os.ftruncate(file, 0)
        os.write(file, json.dumps(describe(command)).encode())
    return file, was_killed


def _owner(file: int) -> str:
    os.lseek(file, 0, os.SEEK_SET)
    return in_words(os.read(file, 4096))
