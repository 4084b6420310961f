"""An OUT on object storage: written and read here as files, kept there as objects.

pxr, numpy and PIL want files. So where OUT is an address (`s3://...`), a command works in a folder
of this machine that lasts as long as it does, and each of a cluster's workers in one of the same
name on its own machine:

- `keep` puts what was written under its final name, whole, what tells of the others last. A large
  file is then taken away here: the disk holds what is at work, never the build.
- `bring` fetches what is about to be read; the small files that steer a build come at the start.

In any other folder these do nothing, so that readers and writers just call them.
"""

import os
import re
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, TypeVar

from stereocell.model.errors import OutputError, StereoCellError, UsageError
from stereocell.storage.lock import LOCK, Claim, alone_at, has_ended, held, working_for
from stereocell.storage.processes import is_alive, machine

T = TypeVar("T")
R = TypeVar("R")
Size = int | None  # of an object in bytes; None: it is gone

_SMALL_BYTES = 1 << 16
# what tells of others is put after them, in this order
_LAST = ("tile.usdc", "stage.usda", "files.json", "manifest.json", "unit.json", "tile.json")
# what steers a build: a few objects for each unit, all small
_STEERING = re.compile(
    r"[^/]+\.(json|toml)|units/[^/]+|units/[^/]+/[^/]+/(iso-[^/]+|[^/]+/unit\.json)"
    r"|units/[^/]+/stage\.json|stage/stage\.usda|stage/looks/.+|tissue/[^/]+\.json"
)
# of whose command: where it runs, and its process
_SCRATCH = re.compile(r"stereocell\.([0-9a-f]{8})\.(\d+)\.\w+")
_LONGEST_S = 7 * 24 * 3600.0  # no command of another machine works for so long in one folder


@dataclass(frozen=True, slots=True)
class Place:
    """Where OUT lies, and the folder in which it is worked on. Picklable."""

    address: str
    root: Path

    @property
    def shown(self) -> str:
        """The address without what it may hold in secret."""
        from stereocell.storage.location import Location

        return Location.of(self.address).shown.rstrip("/")


class Mirror:
    """One OUT on object storage, as this process knows it.

    sizes  of all objects by key, where they are known (in the process that runs the command, which
           alone is in OUT); None: the storage is asked each time
    claim  what OUT's lock says as long as the command is at work for which this process works
    news   what this process has put and removed since somebody asked
    """

    def __init__(self, place: Place, claim: bytes = b"") -> None:
        self.place = place
        self.claim = claim
        self.sizes: dict[str, int] | None = None
        self.news: dict[str, Size] = {}
        self.making: set[Path] = set()  # folders that this process will keep as a whole
        self.moves: dict[str, str] = {}  # into one of them: from where, by what it is called there
        self._folders: dict[str, set[str]] = {}
        self._require_alone: Callable[[], None] = self._require_claim

    @cached_property
    def _storage(self) -> tuple[Any, str]:
        """The file system of fsspec, and OUT's path in it."""
        import fsspec

        from stereocell.storage.location import ANSWER_S, Location, does_answer

        address = self.place.address
        options = Location.of(address).storage_options
        with self._telling("", "read"):
            fs, path = fsspec.core.url_to_fs(address, use_listings_cache=False, **options)
        if not does_answer(fs, path):
            raise OutputError(
                f"{self.place.shown}: no answer within {ANSWER_S:g} s, expected a store that is up"
            )
        return fs, str(path).rstrip("/")

    @contextmanager
    def alone(self, command: str) -> Iterator[None]:
        """Hold OUT for a command that writes into it. Raises OutputError."""
        fs, base = self._storage
        with ExitStack() as stack:
            with self._telling(LOCK, "written"):
                self._require_alone = stack.enter_context(
                    alone_at(fs, f"{base}/{LOCK}", self.place.shown, command)
                )
                self.claim = fs.cat_file(f"{base}/{LOCK}")
            yield

    def _require_claim(self) -> None:
        """Raise OutputError if the command that this worker works for has ended."""
        if self.claim:
            fs, base = self._storage
            there = b""
            with self._telling(LOCK, "read"), suppress(FileNotFoundError):
                there = fs.cat_file(f"{base}/{LOCK}")
            if there != self.claim:
                raise has_ended(self.place.shown)

    # --- what lies there

    def list_all(self) -> None:
        """Learn of every object; who holds OUT removes what killed commands left half-made."""
        self.sizes = {}
        found = self._find("")
        for key, size in found.items():
            self._learn(key, size)
        if self.claim:
            self._remove([key for key in found if "/." in f"/{key}" and key != LOCK])

    def keys_of(self, path: Path) -> dict[str, int]:
        """Return the objects of a file or of all below a folder, with their sizes."""
        key = self._key(path)
        if self.sizes is None:
            return self._find(key)
        if key in self.sizes:
            return {key: self.sizes[key]}
        return {each: self.sizes[each] for each in self._below(key)}

    def _find(self, key: str) -> dict[str, int]:
        return {name: int(entry["size"]) for name, entry in self._list(key).items()}

    def _list(self, key: str) -> dict[str, dict[str, Any]]:
        fs, base = self._storage
        with self._telling(key, "read"):
            found = fs.find(f"{base}/{key}" if key else base, detail=True)
        return {name[len(base) + 1 :]: entry for name, entry in found.items()}

    def marks(self, folder: Path) -> list[tuple[str, int, str]]:
        """Return key, bytes and the storage's own mark of each object below a folder, in order."""
        entries = self._list(self._key(folder)).items()
        return [
            (key, int(e["size"]), str(e.get("ETag") or e.get("LastModified") or ""))
            for key, e in sorted(entries)
        ]

    def _below(self, key: str) -> Iterator[str]:
        for name in sorted(self._folders.get(key, ())):
            child = f"{key}/{name}" if key else name
            if self.sizes is not None and child in self.sizes:
                yield child
            else:
                yield from self._below(child)

    def learn(self, news: Mapping[str, Size]) -> None:
        """Take in what a worker has put and removed. Raises OutputError if OUT is another's now."""
        self._require_alone()
        for key, size in news.items():
            self._learn(key, size)

    def _learn(self, key: str, size: Size) -> None:
        self.news[key] = size
        if self.sizes is None:
            return
        parts = key.split("/")
        folders = ["/".join(parts[:k]) for k in range(len(parts))]
        if size is None:
            self.sizes.pop(key, None)
            self._folders.get(folders[-1], set()).discard(parts[-1])
            return
        self.sizes[key] = size
        for folder, name in zip(folders, parts, strict=True):
            self._folders.setdefault(folder, set()).add(name)

    def _key(self, path: Path) -> str:
        key = path.relative_to(self.place.root).as_posix()
        return "" if key == "." else key

    # --- to here

    def bring(self, keys: Iterable[str]) -> list[Path]:
        """Fetch the objects that aren't here; return their files."""
        fs, base = self._storage
        files = {key: self.place.root / key for key in keys}
        missing = {key: file for key, file in files.items() if not file.exists()}
        if not missing:
            return []
        # under another name at first: another worker of this machine may want the same
        parts = {key: f.with_name(f".{f.name}.{os.getpid()}") for key, f in missing.items()}
        for file in missing.values():
            file.parent.mkdir(parents=True, exist_ok=True)
        with self._telling(next(iter(missing)), "read"):
            fs.get([f"{base}/{key}" for key in missing], [str(part) for part in parts.values()])
        for key, part in parts.items():
            os.replace(part, missing[key])
        return list(missing.values())

    # --- to there

    def keep(self, path: Path, there: Mapping[str, str] | None = None) -> None:
        """Put a file, or all of a folder in place of what was there.

        there  what is to be moved into the folder: from where, by what it is called there
        """
        there = there or {}
        files = [path] if path.is_file() else [f for f in path.rglob("*") if f.is_file()]
        here = {self._key(file): file for file in files}
        stale = [key for key in self.keys_of(path) if key not in here and key not in there]
        self._put(here, there)
        self._remove([*stale, *there.values()])
        for key, file in here.items():
            if file.stat().st_size > _SMALL_BYTES and not _STEERING.fullmatch(key):
                file.unlink()

    def _put(self, here: Mapping[str, Path], there: Mapping[str, str]) -> None:
        fs, base = self._storage
        sizes = {key: file.stat().st_size for key, file in here.items()}
        sizes |= {key: self.keys_of(self.place.root / old)[old] for key, old in there.items()}
        ranks = [(rank, key) for key in sizes for rank in [_rank(key)]]
        for rank in sorted({rank for rank, _ in ranks}):
            self._require_alone()
            keys = sorted(key for r, key in ranks if r == rank)
            own, moved = [k for k in keys if k in here], [k for k in keys if k in there]
            with self._telling(keys[0], "written"):
                if own:
                    fs.put([str(here[k]) for k in own], [f"{base}/{k}" for k in own])
                if moved:
                    fs.copy([f"{base}/{there[k]}" for k in moved], [f"{base}/{k}" for k in moved])
            for key in keys:
                self._learn(key, sizes[key])

    def remove(self, path: Path) -> None:
        self._remove(list(self.keys_of(path)))

    def _remove(self, keys: list[str]) -> None:
        if not keys:
            return
        fs, base = self._storage
        with self._telling(keys[0], "removed"):
            fs.rm([f"{base}/{key}" for key in keys])
        for key in keys:
            self._learn(key, None)

    @contextmanager
    def _telling(self, key: str, what: str) -> Iterator[None]:
        from stereocell.storage.library_errors import one_line

        where = f"{self.place.shown}/{key}".rstrip("/")
        with one_line(where, f"an object that can be {what}", OutputError):
            yield


def _rank(key: str) -> int:
    name = key.rpartition("/")[2]
    return _LAST.index(name) + 1 if name in _LAST else 0


# --- what readers and writers call

_open: list[Mirror] = []  # of this process: none or one


def _of(path: Path) -> Mirror | None:
    """Return the mirror that a path lies in."""
    return next((mirror for mirror in _open if path.is_relative_to(mirror.place.root)), None)


def bring(*paths: Path) -> None:
    """Have files, or all of folders, at hand. Raises OutputError."""
    for path in paths:
        mirror = _of(path)
        if mirror is not None and not path.is_file():
            mirror.bring(mirror.keys_of(path))


@contextmanager
def at_hand(*paths: Path) -> Iterator[None]:
    """Have files, or all of folders, at hand within the block; what it fetched is gone afterwards.

    Raises OutputError.
    """
    brought: list[Path] = []
    try:
        for path in paths:
            mirror = _of(path)
            if mirror is not None:
                brought += mirror.bring(mirror.keys_of(path))
        yield
    finally:
        for file in brought:
            file.unlink(missing_ok=True)


def keep(path: Path) -> None:
    """Put a file that was written under its final name. Raises OutputError.

    One of a folder that this process is making is put with the folder.
    """
    mirror = _of(path)
    if mirror is not None and not any(path.is_relative_to(folder) for folder in mirror.making):
        mirror.keep(path)


@contextmanager
def making(folder: Path, final: Path) -> Iterator[None]:
    """Put a folder as a whole that the block makes at `folder` and renames to `final`."""
    mirror = _of(folder)
    if mirror is None or any(folder.is_relative_to(outer) for outer in mirror.making):
        yield
        return
    mirror.remove(folder)
    mirror.making.add(folder)
    try:
        yield
        old, new = mirror._key(folder), mirror._key(final)
        mirror.keep(final, {new + key[len(old) :]: kept for key, kept in mirror.moves.items()})
    finally:
        mirror.making.discard(folder)
        mirror.moves = {}


def move(file: Path, to: Path) -> None:
    """Have a file that is kept in a folder that is being made, too; it may be gone from its own."""
    mirror = _of(file)
    if mirror is not None and not file.is_file():
        mirror.moves[mirror._key(to)] = mirror._key(file)
        return
    to.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(file, to)
    except OSError:  # a file system without
        os.replace(file, to)


def remove(path: Path) -> None:
    """Remove a file, or a folder with all that lies in it, if it is there. Raises OutputError."""
    mirror = _of(path)
    if mirror is not None:
        mirror.remove(path)
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def sizes_below(path: Path) -> dict[Path, int]:
    """Return every file at or below a path, here or kept, in order, with its bytes."""
    mirror = _of(path)
    if mirror is not None:
        return {mirror.place.root / key: n for key, n in sorted(mirror.keys_of(path).items())}
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    return {file: file.stat().st_size for file in files if file.is_file()}


def objects_below(folder: Path) -> list[tuple[str, int, str]] | None:
    """Return key, bytes and mark of all that is kept below a folder: what an edit alters.

    None for a folder that is on no object storage.
    """
    mirror = _of(folder)
    return None if mirror is None else mirror.marks(folder)


def is_mirrored(path: Path) -> bool:
    """Return whether a path is of an OUT on object storage: here are copies, of later times."""
    return _of(path) is not None


def is_file(path: Path) -> bool:
    """Return whether a file is there, here or kept."""
    return path.is_file() or (_of(path) is not None and path in sizes_below(path))


# --- processes


@contextmanager
def opened(address: str, command: str = "", only: str = "") -> Iterator[Path]:
    """Yield the folder of this machine in which an OUT at an address is worked on.

    Holds OUT for a `command` that writes there; without one, all of OUT is fetched, or what lies
    below one folder of it. In errors from inside the block, the address stands for the folder.

    Raises OutputError if nothing can be read there or another command writes there, UsageError for
    an address that can't be written.
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
            mirror.bring(key for key in keys if not command or _STEERING.fullmatch(key))
            yield root
    except StereoCellError as error:
        error.args = tuple(str(part).replace(str(root), mirror.place.shown) for part in error.args)
        raise
    finally:
        _open.remove(mirror)
        shutil.rmtree(root, ignore_errors=True)


def _clear_scratch() -> None:
    """Remove what killed commands left here: this machine's, and others' whose workers ran here."""
    for folder in Path(tempfile.gettempdir()).glob("stereocell.*"):
        name = _SCRATCH.fullmatch(folder.name)
        if name is None:
            continue
        with suppress(OSError):  # another command removes it, too
            is_ours = name[1] == machine()
            age_s = time.time() - folder.stat().st_mtime
            if not is_alive(int(name[2])) if is_ours else age_s > _LONGEST_S:
                shutil.rmtree(folder, ignore_errors=True)


_working = threading.Lock()  # a worker of several threads does one task at a time


@dataclass(frozen=True, slots=True)
class _Carried(Generic[T, R]):
    """A function that finds its OUT on any machine, and tells what it has put there."""

    function: Callable[[T], R]
    place: Place
    claim: bytes

    def __call__(self, task: T) -> tuple[R, dict[str, Size]]:
        with _working:
            mirror = next((mirror for mirror in _open if mirror.place == self.place), None)
            if mirror is None:
                _clear_scratch()
                mirror = Mirror(self.place, self.claim)
                _open[:] = [mirror]
            self.place.root.mkdir(parents=True, exist_ok=True)
            mirror.news.clear()
            return self.function(task), dict(mirror.news)


@dataclass(frozen=True, slots=True)
class _Asked(Generic[T, R]):
    """A function that writes into a folder as long as the command is at work that asked for it."""

    function: Callable[[T], R]
    claim: Claim

    def __call__(self, task: T) -> R:
        with working_for(self.claim):
            return self.function(task)


def carried(function: Callable[[T], R]) -> tuple[Callable[[T], Any], Callable[[Any], R]]:
    """Return what workers are to run instead of a function, and what makes its result of theirs."""
    if not _open:
        claim = held()
        return function if claim is None else _Asked(function, claim), lambda result: result
    mirror = _open[0]

    def settle(answer: tuple[R, dict[str, Size]]) -> R:
        result, news = answer
        mirror.learn(news)
        return result

    return _Carried(function, mirror.place, mirror.claim), settle


def forget_scratch(client: Any) -> None:
    """Remove, on a cluster's workers, the folders in which they worked."""
    if _open:
        with suppress(Exception):  # whatever befell the cluster
            client.run(_forget, _open[0].place.root)


def _forget(root: Path) -> None:
    _open.clear()
    shutil.rmtree(root, ignore_errors=True)
