"""Fetch and upload the objects of an OUT on object storage as files."""

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from stereocell.model.errors import OutputError
from stereocell.storage.claim import LOCK, has_ended
from stereocell.storage.object_lock import alone_at

Size = int | None  # bytes of an object; None: it was removed

_SMALL_BYTES = 1 << 16  # bytes of the largest object that counts as small
# Files that list or describe other files. They are uploaded after all others, in this order.
_LAST = (
    "tile.usdc",
    "contents.usda",
    "stage.usda",
    "files.json",
    "manifest.json",
    "unit.json",
    "tile.json",
    "part.json",
)
# Keys of the objects that steer a build; there are a few for each unit, and all are small.
STEERING = re.compile(
    r"[^/]+\.(json|toml)|units/[^/]+|units/[^/]+/[^/]+/(iso-[^/]+|[^/]+/unit\.json)"
    r"|units/[^/]+/stage\.json|stage/(contents|stage)\.usda|stage/(looks|previews)/.+|tissue/[^/]+\.json"
)


@dataclass(frozen=True, slots=True)
class Place:
    """The address of OUT, and the local folder that stands for it. Picklable."""

    address: str
    root: Path

    @property
    def shown(self) -> str:
        """The address for messages, without secrets."""
        from stereocell.storage.location import Location

        return Location.of(self.address).shown.rstrip("/")


class Mirror:
    """An OUT on object storage, as this process knows it.

    sizes  bytes of all objects by key; None: the storage is asked each time. The process of a
           command knows them, because only the command writes into OUT
    claim  content of OUT's lock, while the command that this process works for runs
    news   objects that this process has uploaded or removed since the last reset
    """

    def __init__(self, place: Place, claim: bytes = b"") -> None:
        self.place = place
        self.claim = claim
        self.sizes: dict[str, int] | None = None
        self.news: dict[str, Size] = {}
        self.making: set[Path] = set()  # folders that this process will upload completely
        self.moves: dict[str, str] = {}  # new key in a folder of `making` -> key of object to move
        self._folders: dict[str, set[str]] = {}
        self._require_alone: Callable[[], None] = self._require_claim

    @cached_property
    def _storage(self) -> tuple[Any, str]:
        """The file system of fsspec, and OUT's path in it."""
        import fsspec

        from stereocell.storage.location import ANSWER_S, Location, does_answer

        address = self.place.address
        options = Location.of(address).storage_options
        with self._one_line("", "read"):
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
            with self._one_line(LOCK, "written"):
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
            with self._one_line(LOCK, "read"), suppress(FileNotFoundError):
                there = fs.cat_file(f"{base}/{LOCK}")
            if there != self.claim:
                raise has_ended(self.place.shown)

    # --- listing

    def list_all(self) -> None:
        """List all objects. The holder of OUT removes temporary objects of killed commands."""
        self.sizes = {}
        found = self._find("")
        for key, size in found.items():
            self._learn(key, size)
        if self.claim:
            self._remove([key for key in found if "/." in f"/{key}" and key != LOCK])

    def keys_of(self, path: Path) -> dict[str, int]:
        """Return the sizes in bytes of a file, or of all files below a folder, by key."""
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
        with self._one_line(key, "read"):
            found = fs.find(f"{base}/{key}" if key else base, detail=True)
        return {name[len(base) + 1 :]: entry for name, entry in found.items()}

    def marks(self, folder: Path) -> list[tuple[str, int, str]]:
        """Return key, bytes and the storage's ETag (or time) of each object below a folder."""
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
        """Record a worker's uploads and removals. Raises OutputError if OUT was taken over."""
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

    # --- download

    def fetch(self, keys: Iterable[str]) -> list[Path]:
        """Fetch the objects that aren't local yet, and return their files."""
        fs, base = self._storage
        files = {key: self.place.root / key for key in keys}
        missing = {key: file for key, file in files.items() if not file.exists()}
        if not missing:
            return []
        # under a temporary name, because another worker may fetch the same object
        parts = {key: f.with_name(f".{f.name}.{os.getpid()}") for key, f in missing.items()}
        for file in missing.values():
            file.parent.mkdir(parents=True, exist_ok=True)
        with self._one_line(next(iter(missing)), "read"):
            fs.get([f"{base}/{key}" for key in missing], [str(part) for part in parts.values()])
        for key, part in parts.items():
            os.replace(part, missing[key])
        return list(missing.values())

    # --- upload

    def upload(self, path: Path, *, there: Mapping[str, str] | None = None) -> None:
        """Upload a file, or a folder in place of the old one.

        there  old keys of objects to move into the folder, by their new keys
        """
        there = there or {}
        files = [path] if path.is_file() else [f for f in path.rglob("*") if f.is_file()]
        here = {self._key(file): file for file in files}
        stale = [key for key in self.keys_of(path) if key not in here and key not in there]
        self._put(here, there)
        self._remove([*stale, *there.values()])
        for key, file in here.items():
            if file.stat().st_size > _SMALL_BYTES and not STEERING.fullmatch(key):
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
            with self._one_line(keys[0], "written"):
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
        with self._one_line(keys[0], "removed"):
            fs.rm([f"{base}/{key}" for key in keys])
        for key in keys:
            self._learn(key, None)

    @contextmanager
    def _one_line(self, key: str, done: str) -> Iterator[None]:
        """Turn errors of the storage inside the block into OutputErrors.

        done  `read`, `written` or `removed`, for the message
        """
        from stereocell.storage.library_errors import one_line

        where = f"{self.place.shown}/{key}".rstrip("/")
        with one_line(where, f"an object that can be {done}", raised=OutputError):
            yield


def _rank(key: str) -> int:
    name = key.rpartition("/")[2]
    return _LAST.index(name) + 1 if name in _LAST else 0
