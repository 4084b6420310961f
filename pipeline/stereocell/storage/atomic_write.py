"""Write a file completely or not at all: under a temporary name beside it, then renamed.

Temporary names are never used twice, and workers of a command that has ended rename nothing. So a
worker that was cut off, for example because its scheduler was killed, can't damage a build that
went on without it. The next writer removes its temporary files.

Before a document of a build takes its place, it is parsed by the code that reads it (documents.py).
If OUT is on object storage, the file is then uploaded (workspace.py).
"""

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from stereocell.model.errors import OutputError
from stereocell.storage.claim import require_asked
from stereocell.storage.documents import require_readable
from stereocell.storage.temporary_names import clear_beside, remove_remains
from stereocell.storage.workspace import making, upload


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path with the suffix of `path`. At the end, it takes the place of `path`.

    If the block raises, nothing is left behind. Raises OutputError if the system refuses (rights,
    space), and for a document that no command could read.
    """
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(4)}{path.suffix}")
    require_asked()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        clear_beside(path)
        try:  # from here on, an interruption removes the temporary file
            temporary.touch()
            yield temporary
            with temporary.open("rb+") as file:
                os.fsync(file.fileno())
            require_readable(path, temporary)
            require_asked()
            os.replace(temporary, path)
            upload(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{path}: can't be written: {error.strerror or error}") from error


def write_bytes(path: Path, content: bytes | bytearray) -> None:
    """Write a file completely or not at all. Raises OutputError."""
    with replacing(path) as temporary:
        temporary.write_bytes(content)


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder beside `path`. At the end, it takes the place of `path`.

    If the block raises, `path` does not change. Remains of a killed run are removed first. Raises
    OutputError if the system refuses (rights, space).
    """
    require_asked()
    token = secrets.token_hex(4)
    new, old = (path.with_name(f".{path.name}.{token}.{word}") for word in ("partial", "old"))
    try:
        clear_beside(path)
        with making(new, path):
            try:  # from here on, an interruption removes the new folder
                new.mkdir(parents=True)
                yield new
                for file in new.rglob("*"):
                    if file.is_file():
                        with file.open("rb+") as opened:
                            os.fsync(opened.fileno())
                require_asked()
                put_in_place(new, path, old)
            finally:
                shutil.rmtree(new, ignore_errors=True)
    except OSError as error:
        raise OutputError(f"{path}: can't be written: {error.strerror or error}") from error


def put_in_place(new: Path, path: Path, old: Path) -> None:
    """Rename a file or a folder to `path`. If that fails, the old file or folder stays.

    old  an unused path. A folder at `path` is moved there first, because a folder with files can't
         be replaced in one step
    """
    try:
        if path.is_dir() or (new.is_dir() and path.exists()):
            os.replace(path, old)
        os.replace(new, path)
    finally:
        if old.exists() and not path.exists():  # failed or interrupted between the two steps
            os.replace(old, path)
        remove_remains(old)
