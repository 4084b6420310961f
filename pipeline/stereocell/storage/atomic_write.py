"""Write a file under a temporary name beside it, flush it, rename it: the whole file or none.

Temporary names are never used twice, and who works for a command that has ended puts nothing in its
place: whoever was cut off from a build that has gone on without it, as a worker whose scheduler was
killed, spoils nothing. Who writes next clears away what it left.

Where OUT is on object storage, it is put there then: see workspace.py.
"""

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from stereocell.model.errors import OutputError
from stereocell.storage.claim import require_asked
from stereocell.storage.temporary_names import clear_beside
from stereocell.storage.workspace import making, upload


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path with the suffix of `path`; on leaving, it takes the place of `path`.

    If the body raises, nothing is left behind. Raises OutputError where the system refuses
    (rights, space).
    """
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(4)}{path.suffix}")
    require_asked()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        clear_beside(path)
        temporary.touch()
        try:
            yield temporary
            with temporary.open("rb+") as file:
                os.fsync(file.fileno())
            require_asked()
            os.replace(temporary, path)
            upload(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{path}: can't be written: {error.strerror or error}") from error


def write_bytes(path: Path, content: bytes) -> None:
    """Put a file of these bytes at `path`, whole or not at all. Raises OutputError."""
    with replacing(path) as temporary:
        temporary.write_bytes(content)


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder beside `path`; on leaving, it takes the place of `path`.

    If the body raises, `path` stays as it was. What a killed run left is cleared away first.
    Raises OutputError where the system refuses (rights, space).
    """
    require_asked()
    token = secrets.token_hex(4)
    new, old = (path.with_name(f".{path.name}.{token}.{word}") for word in ("partial", "old"))
    try:
        clear_beside(path)
        with making(new, path):
            new.mkdir(parents=True)
            try:
                yield new
                for file in new.rglob("*"):
                    if file.is_file():
                        with file.open("rb+") as opened:
                            os.fsync(opened.fileno())
                require_asked()
                _swap(new, path, old)
            finally:
                shutil.rmtree(new, ignore_errors=True)
    except OSError as error:
        raise OutputError(f"{path}: can't be written: {error.strerror or error}") from error


def _swap(new: Path, path: Path, old: Path) -> None:
    """Rename `new` to `path`; a folder that isn't empty can't be renamed over."""
    if path.exists():
        os.replace(path, old)
    try:
        os.replace(new, path)
    except OSError:
        if old.exists():
            os.replace(old, path)
        raise
    shutil.rmtree(old, ignore_errors=True)
