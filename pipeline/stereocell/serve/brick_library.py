"""The trees of a bundle's volumes: built on first request, stored in OUT/bricks, read from there.

A file's name is a hash of its inputs: the volume's KTX2 file, the threshold, the code's version. So
a second start builds nothing, and a new bundle is detected. When a tree is built, files that belong
to no volume of the bundle are removed.

The threshold is the largest intensity that the channel's transfer function leaves invisible. The
function is the one selected in the stage, with which a viewer opens. The lowest threshold of all
functions would mostly come from an unused one. A viewer that switches to a function that
shows more fetches the volume's KTX2 file instead.
"""

import hashlib
import os
import sys
from collections import OrderedDict
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.bundle.manifest import MANIFEST, REMEDY, read_manifest
from stereocell.formats.brick_stream import (
    HASH_BYTES,
    BrickFormatError,
    Table,
    content_hash,
    encode_tree,
    parse_table,
)
from stereocell.formats.ktx2 import decode_finest
from stereocell.formats.voxel_bvh import build
from stereocell.model.errors import OutputError, SourceError
from stereocell.serve.brick_order import PlacedTree, place
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.json_files import read_json

CODE_VERSION = 1  # version of build() and encode_tree(): increase it when their bytes change
_KEPT_NODES = 2_000_000  # nodes of the cached trees: some 300 MB
_KEPT_FILES = 256  # cached trees; each holds its file open


class UnknownVolumeError(OutputError):
    """The bundle lacks this volume."""


@dataclass(frozen=True, slots=True)
class Volume:
    """A volume of the bundle. entry: its part of volumes.json; threshold: intensity, -1 to 254."""

    tile: str
    channel: str
    entry: dict[str, Any]
    threshold: int

    @property
    def source(self) -> str:
        """The SHA-256 of its KTX2 file, in hexadecimal."""
        sha256: str = self.entry["file"]["sha256"]
        return sha256

    @property
    def file_name(self) -> str:
        """Name of its tree in OUT/bricks."""
        made_of = f"{self.source} threshold {self.threshold} code {CODE_VERSION}"
        return f"{hashlib.sha256(made_of.encode()).hexdigest()[:32]}.bvh"


class BrickFile:
    """A tree on disk: its table is in memory, its bricks are read on request."""

    def __init__(self, path: Path, volume: Volume) -> None:
        """Open a tree. Raises BrickFormatError where it is damaged, OSError where it is missing."""
        data = path.read_bytes()
        table = parse_table(data)
        if table.source.hex() != volume.source[: 2 * HASH_BYTES]:
            raise BrickFormatError(f"{path}: the tree of another volume")
        lengths = table.nodes["length"].astype(np.int64)
        self._ends = table.bytes + np.cumsum(lengths)
        if len(data) != self._ends[-1]:
            raise BrickFormatError(f"{path}: {len(data)} bytes, expected {self._ends[-1]}")
        for node in np.flatnonzero(lengths).tolist():
            end = int(self._ends[node])
            found = content_hash(data[end - int(lengths[node]) : end])
            if found != table.nodes["hash"][node].tobytes():
                raise BrickFormatError(f"{path}: the brick of node {node} is spoilt")
        self.volume = volume
        self.table_bytes = data[: table.bytes]
        self.table: Table = parse_table(self.table_bytes)  # keeps no brick in memory
        self.table_hash = content_hash(self.table_bytes).hex()
        self.placed: PlacedTree = place(self.table, volume.entry)
        self._file = path.open("rb")
        self._reading = Lock()  # of the file's position

    def read(self, nodes: Sequence[int]) -> list[bytes]:
        """Return the zstd frames of these nodes."""
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


class BrickLibrary:
    """The trees of one bundle. Its methods are thread-safe and may take seconds."""

    def __init__(self, bundle: Path, folder: Path) -> None:
        """bundle: the folder of manifest.json; folder: the folder of the trees."""
        self._bundle = bundle
        self._folder = folder
        self._stamp: tuple[int, int] | None = None
        self._volumes: dict[tuple[str, str], Volume] = {}
        self._files: OrderedDict[tuple[str, str], BrickFile] = OrderedDict()
        self._building = Lock()  # one tree is built at a time
        self._listing = Lock()
        self._keeping = Lock()
        self.built = 0

    def volumes(self) -> dict[tuple[str, str], Volume]:
        """Return the volumes by (tile, channel), read again where the bundle was written anew.

        Raises OutputError where the bundle is missing, SourceError where it is damaged.
        """
        with self._listing:
            path = self._bundle / MANIFEST
            try:
                status = path.stat()
            except OSError as error:
                raise OutputError(f"{path.name}: {error.strerror}: {REMEDY}") from None
            stamp = (status.st_mtime_ns, status.st_ino)
            if stamp != self._stamp:
                self._volumes = _read_volumes(self._bundle)
                self._stamp = stamp
            return self._volumes

    def open(self, tile: str, channel: str) -> BrickFile:
        """Return a volume's tree; build it where necessary.

        Raises UnknownVolumeError; OutputError and SourceError where the bundle is damaged.
        """
        file = self.open_built(tile, channel)
        if file is None:
            with self._building:
                file = self.open_built(tile, channel)  # another thread may have built it
                if file is None:
                    file = self._make(self._volume(tile, channel))
        return file

    def open_built(self, tile: str, channel: str) -> BrickFile | None:
        """Return a volume's tree if it exists and is whole; never waits for a build.

        Raises the errors of open().
        """
        volume = self._volume(tile, channel)
        file = self._find(volume)
        if file is None:
            try:
                file = BrickFile(self._folder / volume.file_name, volume)
            except (FileNotFoundError, BrickFormatError):
                return None
            self._keep(file)
        return file

    def _volume(self, tile: str, channel: str) -> Volume:
        volume = self.volumes().get((tile, channel))
        if volume is None:
            raise UnknownVolumeError(f"the bundle has no volume of tile {tile}, channel {channel}")
        return volume

    def _find(self, volume: Volume) -> BrickFile | None:
        with self._keeping:
            file = self._files.get(_key(volume))
            if file is None or file.volume != volume:
                return None
            self._files.move_to_end(_key(volume))
            return file

    def _keep(self, file: BrickFile) -> None:
        """Cache a tree; drop those that were used longest ago."""
        with self._keeping:
            self._files[_key(file.volume)] = file
            self._files.move_to_end(_key(file.volume))
            nodes = sum(len(kept.table.nodes) for kept in self._files.values())
            while len(self._files) > 1 and (nodes > _KEPT_NODES or len(self._files) > _KEPT_FILES):
                _, oldest = self._files.popitem(last=False)
                nodes -= len(oldest.table.nodes)

    def _make(self, volume: Volume) -> BrickFile:
        path = self._folder / volume.file_name
        write_bytes(path, self._build(volume))
        self.built += 1
        wanted = {v.file_name for v in self.volumes().values()}
        for old in self._folder.glob("*.bvh"):
            if old.name not in wanted and not old.name.startswith("."):
                with suppress(PermissionError):  # Windows removes no open file: the next time
                    old.unlink(missing_ok=True)
        file = BrickFile(path, volume)
        self._keep(file)
        return file

    def _build(self, volume: Volume) -> bytes:
        name = volume.entry["file"]["path"]
        data = _read(self._bundle, volume.entry["file"])
        try:
            texture = decode_finest(data)
        except SourceError as error:
            raise SourceError(f"{name}: {error}: {REMEDY}") from None
        if list(texture.shape[2::-1]) != volume.entry["size"] or texture.shape[3] != 1:
            raise SourceError(f"{name}: {texture.shape[2::-1]} texels: {REMEDY}")
        source = bytes.fromhex(volume.source)[:HASH_BYTES]
        return encode_tree(build(texture[..., 0], volume.threshold), source)


def _key(volume: Volume) -> tuple[str, str]:
    return volume.tile, volume.channel


def invisible_below(row: NDArray[np.uint8]) -> int:
    """Return the largest intensity that a row of a table, uint8 (256, 4), leaves at 0; -1: none.

    Texel k is intensity k; between texels opacity is linear, so everything up to the last texel
    before the first opaque one is invisible.
    """
    shown = row[:, 3] > 0
    first = int(shown.argmax()) if shown.any() else 255
    return min(first, 255) - 1


def _read_volumes(bundle: Path) -> dict[tuple[str, str], Volume]:
    manifest = read_manifest(bundle)
    found = {}
    for channel in manifest["channels"]:
        listed = read_json(bundle / channel["volumes"]["path"], "volumes.schema.json", REMEDY)
        name = channel["lut"]["path"]
        try:
            lut = decode_finest(_read(bundle, channel["lut"]))[0]
        except SourceError as error:
            raise SourceError(f"{name}: {error}: {REMEDY}") from None
        names = channel["transfer_functions"]
        if lut.shape != (len(names), 256, 4):
            wanted = f"{len(names)} rows of 256 RGBA"
            raise SourceError(f"{name}: {lut.shape} texels, expected {wanted}: {REMEDY}")
        if channel["transfer_function"] not in names:
            chosen = channel["transfer_function"]
            raise SourceError(f"{MANIFEST}: {chosen} is none of {', '.join(names)}: {REMEDY}")
        threshold = invisible_below(lut[names.index(channel["transfer_function"])])
        for entry in listed["volumes"]:
            found[entry["tile"], channel["id"]] = Volume(
                entry["tile"], channel["id"], entry, threshold
            )
    return found


def _read(bundle: Path, ref: dict[str, Any]) -> bytes:
    """Return a file of the bundle. Raises SourceError where it doesn't match its FileRef."""
    try:
        data = (bundle / ref["path"]).read_bytes()
    except OSError as error:
        raise SourceError(f"{ref['path']}: {error.strerror}: {REMEDY}") from None
    if hashlib.sha256(data).hexdigest() != ref["sha256"]:
        raise SourceError(f"{ref['path']}: its SHA-256 is not the manifest's: {REMEDY}")
    return data
