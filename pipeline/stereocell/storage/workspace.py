"""An OUT on object storage: written and read here as files, stored there as objects.

pxr, numpy and PIL need files. So where OUT is an address (`s3://...`), a command works in a
temporary folder of this machine, and each worker of a cluster in one of the same name on its own
machine:

- `upload` stores a written file or folder under its final name, whole, files that describe others
  last. It then removes a large file here: the disk holds the work in progress, never the build.
- `fetch` gets a file before it is read; small files that steer a build are fetched at the start.

For any other folder these functions do nothing. Few modules call them: the functions that read and
write all documents (seals.py, atomic_write.py, file_list.py), the runner of steps for the inputs of
each task, and `OutFolder` for phases and checks. Four more know which one of many large files they
need, so that the disk never holds all: `usd` for a layer or a tile of a stage,
`steps/unit_files.py` for a file of a unit, `steps/open_source.py` for the voxels of an added
channel, `steps/tissue_files.py` for those of all classes. `bundle/write.py` moves the files of
finished tiles.
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

# folder of a command: its machine, its process
_SCRATCH = re.compile(r"stereocell\.([0-9a-f]{8})\.(\d+)\.\w+")
_LONGEST_S = 7 * 24 * 3600.0  # longest work of another machine's command in one folder

_open: list[Mirror] = []  # of this process: none or one


def _of(path: Path) -> Mirror | None:
    """Return the mirror that a path lies in; None: the path is local."""
    return next((mirror for mirror in _open if path.is_relative_to(mirror.place.root)), None)


def fetch(*paths: Path) -> None:
    """Fetch files, or all files of folders. Raises OutputError where the storage fails."""
    for path in paths:
        mirror = _of(path)
        if mirror is not None and not path.is_file():
            mirror.fetch(mirror.keys_of(path))


@contextmanager
def cached(*paths: Path) -> Iterator[None]:
    """Fetch files, or all files of folders, for the block; fetched files are removed at its end.

    Raises OutputError where the storage fails.
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

    A file of a folder that this process is making is uploaded with the folder.
    """
    mirror = _of(path)
    if mirror is not None and not any(path.is_relative_to(folder) for folder in mirror.making):
        mirror.upload(path)


@contextmanager
def making(folder: Path, final: Path) -> Iterator[None]:
    """Upload a folder as a whole: the block writes it at `folder` and renames it to `final`."""
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
    """Move or link a stored file into a folder that is being made; its old path may vanish."""
    mirror = _of(file)
    if mirror is not None and not file.is_file():
        mirror.moves[mirror._key(to)] = mirror._key(file)
        return
    to.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(file, to)
    except OSError:  # a file system without links
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
    """Return every file at or below a path, local or stored, in order, with its bytes."""
    mirror = _of(path)
    if mirror is not None:
        return {mirror.place.root / key: n for key, n in sorted(mirror.keys_of(path).items())}
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    return {file: file.stat().st_size for file in files if file.is_file()}


def names_in(folder: Path) -> list[str]:
    """Return the names in a folder, local or on object storage; empty if it is no folder.

    Raises OutputError where it can't be listed.
    """
    mirror = _of(folder)
    if mirror is not None:
        below = {file.relative_to(folder).parts for file in sizes_below(folder) if file != folder}
        return sorted({parts[0] for parts in below})
    return names_in_folder(folder)


def objects_below(folder: Path) -> list[tuple[str, int, str]] | None:
    """Return key, bytes and mark of all objects below a folder: an edit changes them.

    None for a folder that is on no object storage.
    """
    mirror = _of(folder)
    return None if mirror is None else mirror.marks(folder)


def is_file(path: Path) -> bool:
    """Return whether a file exists, local or stored."""
    return path.is_file() or (_of(path) is not None and path in sizes_below(path))


def is_mirrored(path: Path) -> bool:
    """Return whether a path belongs to an OUT on object storage: local copies have later times."""
    return _of(path) is not None


@contextmanager
def opened(address: str, *, command: str = "", only: str = "") -> Iterator[Path]:
    """Yield the folder of this machine that stands for an OUT at an address.

    command  writes into OUT, which is held for it; empty: all of OUT is fetched
    only     without a command: fetch only the objects below this folder of OUT

    In errors from inside the block, the address replaces the folder. Raises OutputError where the
    storage fails or another command writes there, UsageError for an address that can't be written.
    """
    if address.partition("://")[0] in ("http", "https"):
        from stereocell.storage.location import Location

        raise UsageError(
            f"OUT is {Location.of(address).shown}: expected a folder or an s3:// address"
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
    """Remove folders that killed commands left here: this machine's, and old ones of others."""
    for folder in Path(tempfile.gettempdir()).glob("stereocell.*"):
        name = _SCRATCH.fullmatch(folder.name)
        if name is None:
            continue
        with suppress(OSError):  # another command removes it, too
            is_ours = name[1] == machine()
            age_s = time.time() - folder.stat().st_mtime
            if not is_alive(int(name[2])) if is_ours else age_s > _LONGEST_S:
                shutil.rmtree(folder, ignore_errors=True)


def joined(place: Place, claim: bytes) -> Mirror:
    """Return the mirror of an OUT on which this process works for a command elsewhere."""
    mirror = next((mirror for mirror in _open if mirror.place == place), None)
    if mirror is None:
        _clear_scratch()
        mirror = Mirror(place, claim)
        _open[:] = [mirror]
    place.root.mkdir(parents=True, exist_ok=True)
    return mirror


def opened_here() -> Mirror | None:
    """Return the mirror that this process works on; None: OUT is a folder."""
    return _open[0] if _open else None


def forget(root: Path) -> None:
    """Close the mirror of this process and remove its folder."""
    _open.clear()
    shutil.rmtree(root, ignore_errors=True)
