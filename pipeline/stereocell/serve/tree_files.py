"""The trees of volumes in one folder: found, kept open, and made where they are missing.

A file's name is a hash of its inputs: the volume's KTX2 file, the threshold and the code's version.
A folder may have a limit in bytes. The trees that were used longest ago are then removed, except
those that are held because their bricks are being sent.
"""

import hashlib
import os
import sys
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock, RLock
from typing import Any

import numpy as np

from stereocell.formats.brick_stream import (
    HASH_BYTES,
    BrickFormatError,
    Table,
    content_hash,
    parse_table,
)
from stereocell.model.errors import OutputError
from stereocell.serve.brick_order import PlacedTree, place
from stereocell.storage.atomic_write import write_bytes

CODE_VERSION = 1  # version of build() and encode_tree(): increase it when their bytes change
_CACHED_NODES = 2_000_000  # most nodes of all cached trees, about 300 MB
_CACHED_FILES = 256  # most cached trees; each keeps its file open


class FullError(OutputError):
    """A folder with a limit has no room for another tree."""


@dataclass(frozen=True, slots=True)
class Volume:
    """A volume of a bundle.

    entry      the volume's entry in volumes.json
    threshold  intensity, -1 to 254; the tree omits voxels up to it
    window     the channel's intensity window, in voxel values
    """

    tile: str
    channel: str
    entry: dict[str, Any]
    threshold: int
    window: tuple[float, float] = (0.0, 255.0)

    @property
    def source(self) -> str:
        """The SHA-256 of the volume's KTX2 file, in hexadecimal."""
        sha256: str = self.entry["file"]["sha256"]
        return sha256

    @property
    def size(self) -> list[int]:
        """Numbers of texels (x, y, z) of the volume's tree."""
        size: list[int] = self.entry.get("finer_size", self.entry["size"])
        return size

    @property
    def file_name(self) -> str:
        """Name of the tree's file in its folder."""
        finer = f" of {self.size} texels" if "finer_size" in self.entry else ""
        made_of = f"{self.source} threshold {self.threshold} code {CODE_VERSION}{finer}"
        return f"{hashlib.sha256(made_of.encode()).hexdigest()[:32]}.bvh"


class BrickFile:
    """A tree on disk: the table is in memory, the bricks are read on request."""

    def __init__(self, path: Path, volume: Volume) -> None:
        """Open a tree. Raises BrickFormatError if it is damaged, OSError if it is missing."""
        data = path.read_bytes()
        table = parse_table(data)
        if table.source.hex() != volume.source[: 2 * HASH_BYTES]:
            raise BrickFormatError(f"{path}: this is the tree of another volume")
        lengths = table.nodes["length"].astype(np.int64)
        self._ends = table.bytes + np.cumsum(lengths)
        if len(data) != self._ends[-1]:
            raise BrickFormatError(f"{path}: {len(data)} bytes, expected {self._ends[-1]}")
        for node in np.flatnonzero(lengths).tolist():
            end = int(self._ends[node])
            found = content_hash(data[end - int(lengths[node]) : end])
            if found != table.nodes["hash"][node].tobytes():
                raise BrickFormatError(f"{path}: the brick of node {node} is damaged")
        self.volume = volume
        self.table_bytes = data[: table.bytes]
        # This second table refers to the copied bytes, so that `data` with its bricks is freed.
        self.table: Table = parse_table(self.table_bytes)
        self.table_hash = content_hash(self.table_bytes).hex()
        self.placed: PlacedTree = place(self.table, volume.entry)
        self._file = path.open("rb")
        self._reading = Lock()  # protects the file's position

    def read(self, nodes: Sequence[int]) -> list[bytes]:
        """Return the bricks of these nodes, each a zstd frame."""
        found = []
        for node in nodes:
            length = int(self.table.nodes["length"][node])
            found.append(self._read_at(int(self._ends[node]) - length, length))
        return found

    def _read_at(self, start: int, length: int) -> bytes:
        if sys.platform != "win32":
            return os.pread(self._file.fileno(), length, start)
        with self._reading:  # Windows has no pread
            self._file.seek(start)
            return self._file.read(length)

    def __del__(self) -> None:
        if hasattr(self, "_file"):
            self._file.close()


class TreeFiles:
    """The trees in one folder. Its methods are thread-safe; `make` may take seconds."""

    def __init__(self, folder: Path, most_bytes: int | None = None) -> None:
        """most_bytes: limit for all trees in the folder together; None for no limit."""
        self._folder, self._most = folder, most_bytes
        self._open: OrderedDict[tuple[str, str, str], BrickFile] = OrderedDict()
        self._bytes: OrderedDict[str, int] = OrderedDict()  # bytes by file name, last used at end
        self._held: dict[object, frozenset[str]] = {}
        self._building = Lock()  # one tree is built at a time
        self._caching = RLock()
        self.built = 0

    def find(self, volume: Volume) -> BrickFile | None:
        """Return a volume's tree if it exists and is undamaged; never wait for a build."""
        with self._caching:
            file = self._open.get(_key(volume))
            if file is not None and file.volume == volume:
                self._use(volume)
                return file
        try:
            file = BrickFile(self._folder / volume.file_name, volume)
        except (FileNotFoundError, BrickFormatError):
            return None
        self._cache(file)
        return file

    def make(
        self, volume: Volume, build: Callable[[], bytes], names: Callable[[], Collection[str]]
    ) -> BrickFile:
        """Return a volume's tree; build it if it is missing.

        build  returns the file's content
        names  returns the names of the trees that stay in a folder without a limit

        Raises FullError, and the errors of `build`.
        """
        with self._building:
            file = self.find(volume)  # another thread may have built it
            if file is not None:
                return file
            content, path = build(), self._folder / volume.file_name
            if self._most is not None:
                self._make_room(len(content), self._most)
            write_bytes(path, content)
            self.built += 1
            with self._caching:
                self._bytes[path.name] = len(content)
            if self._most is None:
                self._remove_others(names())
            file = BrickFile(path, volume)
            self._cache(file)
            return file

    def hold(self, owner: object, volumes: Iterable[Volume]) -> None:
        """Keep the trees of these volumes until `owner` holds others or releases them."""
        with self._caching:
            self._held[owner] = frozenset(volume.file_name for volume in volumes)

    def release(self, owner: object) -> None:
        """Allow the removal of the trees that `owner` held."""
        with self._caching:
            self._held.pop(owner, None)

    def _cache(self, file: BrickFile) -> None:
        """Cache a tree; drop the trees that were used longest ago if there are too many."""
        with self._caching:
            self._open[_key(file.volume)] = file
            self._use(file.volume)
            nodes = sum(len(kept.table.nodes) for kept in self._open.values())
            while len(self._open) > 1 and (
                nodes > _CACHED_NODES or len(self._open) > _CACHED_FILES
            ):
                _, oldest = self._open.popitem(last=False)
                nodes -= len(oldest.table.nodes)

    def _use(self, volume: Volume) -> None:
        self._open.move_to_end(_key(volume))
        if volume.file_name in self._bytes:
            self._bytes.move_to_end(volume.file_name)

    def _make_room(self, wanted: int, most: int) -> None:
        """Remove trees, those used longest ago first, until `wanted` bytes have room."""
        with self._caching:
            held = frozenset[str]().union(*self._held.values())
            for name in [name for name in self._bytes if name not in held]:
                if sum(self._bytes.values()) + wanted <= most:
                    return
                self._remove(name)
            if sum(self._bytes.values()) + wanted > most:
                raise FullError(
                    f"{self._folder}: a tree of {wanted:,} bytes does not fit, expected at most "
                    f"{most:,} for all trees in view: this volume stays coarse"
                )

    def _remove_others(self, names: Collection[str]) -> None:
        with self._caching:
            for old in self._folder.glob("*.bvh"):
                if old.name not in names and not old.name.startswith("."):
                    self._remove(old.name)

    def _remove(self, name: str) -> None:
        for key in [key for key in self._open if key[2] == name]:
            del self._open[key]
        with suppress(PermissionError):  # Windows can't remove an open file; the next call tries
            (self._folder / name).unlink(missing_ok=True)
            self._bytes.pop(name, None)


def _key(volume: Volume) -> tuple[str, str, str]:
    return volume.tile, volume.channel, volume.file_name
