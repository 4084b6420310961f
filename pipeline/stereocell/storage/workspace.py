"""Read and write an OUT on object storage as if it were a local folder.

pxr, numpy and PIL need files. So if OUT is an address (`s3://...`), a command works in a temporary
folder of this machine. Each worker of a cluster works in a folder of the same name on its machine.

- `upload` stores a written file or folder completely, under its final name, and files that describe
  others last. Then it removes large local files, so that the disk holds only the work in progress.
- `fetch` gets a file before it is read. Small files that steer a build are fetched at the start.

For a local OUT these functions do nothing. Few modules call them:

- seals.py, atomic_write.py and file_list.py, which read and write all documents
- the runner of steps, for the inputs of each task
- `OutFolder`, for phases and checks
- `usd`, for a layer or a tile of a stage
- `steps/unit_files.py`, for a file of a unit
- `steps/open_source.py`, for an added channel
- `steps/tissue_files.py`, for all classes
- `bundle/write.py`, which moves the files of finished parts
"""

import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path

from stereocell.model.errors import StereoCellError, UsageError
from stereocell.storage.folder_names import names_in_folder
from stereocell.storage.object_store import STEERING, Mirror, Place
from stereocell.storage.processes import is_alive, machine

# Name of a command's folder, with its machine and process
_SCRATCH = re.compile(r"stereocell\.([0-9a-f]{8})\.(\d+)\.\w+")
_LONGEST_S = 7 * 24 * 3600.0  # s; older folders of other machines are abandoned

_open: list[Mirror] = []  # the mirror of this process, if it has one


def _of(path: Path) -> Mirror | None:
    """Return the mirror to which a path belongs; None: OUT is local."""
    return next((mirror for mirror in _open if path.is_relative_to(mirror.place.root)), None)


def fetch(*paths: Path) -> None:
    """Fetch files, or all files of folders. Raises OutputError if the storage fails."""
    for path in paths:
        mirror = _of(path)
        if mirror is not None and not path.is_file():
            mirror.fetch(mirror.keys_of(path))


@contextmanager
def cached(*paths: Path) -> Iterator[None]:
    """Fetch files, or all files of folders, for the block, and remove them at its end.

    Raises OutputError if the storage fails.
    """
    fetched: list[Path] = []
    try:
        for path in paths:
            mirror = _of(path)
            if mirror is not None:
                fetched += mirror.fetch(mirror.keys_of(path))
        yield
    finally:
        for file in fetched:
            file.unlink(missing_ok=True)


def upload(path: Path) -> None:
    """Upload a file that was written under its final name. Raises OutputError.

    A file in a folder that this process is making is uploaded later, with the folder.
    """
    mirror = _of(path)
    if mirror is not None and not any(path.is_relative_to(folder) for folder in mirror.making):
        mirror.upload(path)


@contextmanager
def making(folder: Path, final: Path) -> Iterator[None]:
    """Upload a folder completely, which the block writes at `folder` and renames to `final`."""
    mirror = _of(folder)
    if mirror is None or any(folder.is_relative_to(outer) for outer in mirror.making):
        yield
        return
    mirror.remove(folder)
    mirror.making.add(folder)
    try:
        yield
        old, new = mirror._key(folder), mirror._key(final)
        moved = {new + key[len(old) :]: kept for key, kept in mirror.moves.items()}
        mirror.upload(final, there=moved)
    finally:
        mirror.making.discard(folder)
        mirror.moves = {}


def move(file: Path, to: Path) -> None:
    """Move or link a file into a folder that is being made. Its old path may vanish."""
    mirror = _of(file)
    if mirror is not None and not file.is_file():
        mirror.moves[mirror._key(to)] = mirror._key(file)
        return
    to.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(file, to)
    except OSError:  # the file system has no hard links
        os.replace(file, to)


def remove(path: Path) -> None:
    """Remove a file, or a folder with all its files, if it exists. Raises OutputError."""
    mirror = _of(path)
    if mirror is not None:
        mirror.remove(path)
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def sizes_below(path: Path) -> dict[Path, int]:
    """Return the sizes in bytes of all files at or below a path, local or stored, sorted."""
    mirror = _of(path)
    if mirror is not None:
        return {mirror.place.root / key: n for key, n in sorted(mirror.keys_of(path).items())}
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    return {file: file.stat().st_size for file in files if file.is_file()}


def names_in(folder: Path) -> list[str]:
    """Return the names in a folder, local or on object storage; empty: it is not a folder.

    Raises OutputError if it can't be listed.
    """
    mirror = _of(folder)
    if mirror is not None:
        below = {file.relative_to(folder).parts for file in sizes_below(folder) if file != folder}
        return sorted({parts[0] for parts in below})
    return names_in_folder(folder)


def objects_below(folder: Path) -> list[tuple[str, int, str]] | None:
    """Return key, bytes and mark of all objects below a folder, to notice edits.

    None: the folder is not on object storage.
    """
    mirror = _of(folder)
    return None if mirror is None else mirror.marks(folder)


def is_file(path: Path) -> bool:
    """Return whether a file exists, local or stored."""
    return path.is_file() or (_of(path) is not None and path in sizes_below(path))


def is_mirrored(path: Path) -> bool:
    """Return whether a path belongs to an OUT on object storage.

    The times of its local copies then mean nothing, because they are those of fetching.
    """
    return _of(path) is not None


@contextmanager
def opened(address: str, *, command: str = "", only: str = "") -> Iterator[Path]:
    """Yield the local folder that stands for an OUT at an address.

    command  command that writes into OUT, for which OUT is held; empty: OUT is only read, and
             fetched
    only     folder of OUT to fetch if there is no command; empty: all of OUT

    In errors from inside the block, the address replaces the folder. Raises OutputError if the
    storage fails or another command writes there, UsageError for an address that can't be written.
    """
    if address.partition("://")[0] in ("http", "https"):
        from stereocell.storage.location import Location

        raise UsageError(
            f"OUT is {Location.of(address).shown}, expected a folder or an s3:// address"
        )
    _clear_scratch()
    root = Path(tempfile.mkdtemp(prefix=f"stereocell.{machine()}.{os.getpid()}.")).resolve()
    mirror = Mirror(Place(address.rstrip("/"), root))
    _open.append(mirror)
    try:
        with mirror.alone(command) if command else nullcontext():
            mirror.list_all()
            keys = mirror.keys_of(root / only)
            mirror.fetch(key for key in keys if not command or STEERING.fullmatch(key))
            yield root
    except StereoCellError as error:
        error.args = tuple(str(part).replace(str(root), mirror.place.shown) for part in error.args)
        raise
    finally:
        _open.remove(mirror)
        shutil.rmtree(root, ignore_errors=True)


def _clear_scratch() -> None:
    """Remove the temporary folders of killed commands: this machine's, and old ones of others."""
    for folder in Path(tempfile.gettempdir()).glob("stereocell.*"):
        name = _SCRATCH.fullmatch(folder.name)
        if name is None:
            continue
        with suppress(OSError):  # another command may remove the folder at the same time
            is_ours = name[1] == machine()
            age_s = time.time() - folder.stat().st_mtime
            if not is_alive(int(name[2])) if is_ours else age_s > _LONGEST_S:
                shutil.rmtree(folder, ignore_errors=True)


def joined(place: Place, claim: bytes) -> Mirror:
    """Return the mirror of an OUT on which this worker works for a command on another machine."""
    mirror = next((mirror for mirror in _open if mirror.place == place), None)
    if mirror is None:
        _clear_scratch()
        mirror = Mirror(place, claim)
        _open[:] = [mirror]
    place.root.mkdir(parents=True, exist_ok=True)
    return mirror


def opened_here() -> Mirror | None:
    """Return the mirror on which this process works; None: OUT is a local folder."""
    return _open[0] if _open else None


def forget(root: Path) -> None:
    """Close the mirror of this process and remove its folder."""
    _open.clear()
    shutil.rmtree(root, ignore_errors=True)
