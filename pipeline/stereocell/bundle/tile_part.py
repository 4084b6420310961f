"""Write and read parts of a bundle, each of one channel of a tile: record and files.

A part is a folder. It holds files of the bundle under their paths in the bundle, and the record
tile.json with the data that the bundle's common files need.
"""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import AliasChoices, ConfigDict, Field, TypeAdapter, ValidationError

from stereocell.formats.tiles3d import TileLod
from stereocell.model.errors import OutputError
from stereocell.model.tile_content import Representation
from stereocell.model.world_box import WorldPoint
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.file_list import sizes_of
from stereocell.storage.json_files import read_json, write_json

_RECORD = "tile.json"
# The records of earlier versions call the areas of interfaces `wall_um2`.
_INTERFACE_UM2 = Field(validation_alias=AliasChoices("interface_um2", "wall_um2"))


@dataclass(frozen=True, slots=True)
class FileRef:
    """A file of the bundle. `path` is relative to the bundle's root, with forward slashes."""

    path: str
    bytes: int
    sha256: str


@dataclass(frozen=True, slots=True)
class PackedObjects:
    """The objects of one tile, as bytes of little-endian arrays.

    labels    uint64 (n,), numbers in the label map
    names     name of each object; empty: the objects have no names
    values    float32 (n,) by column ID
    boxes     float32 (n, 6), least and largest (x, y, z), world um
    touching  uint64 (m, 2), labels of objects that share an interface
    interface_um2  float32 (m,), area of each interface, um^2; NaN: not known
    """

    __pydantic_config__ = ConfigDict(ser_json_bytes="base64", val_json_bytes="base64")

    labels: bytes
    names: tuple[str, ...]
    values: dict[str, bytes]
    boxes: bytes
    touching: bytes
    interface_um2: Annotated[bytes, _INTERFACE_UM2]


@dataclass(frozen=True, slots=True)
class TileChannel:
    """One channel of a tile in the bundle.

    lods       levels for the tileset, finest first; addresses are relative to the tileset
    triangles  number of triangles of each level; left-out finer levels repeat the finest one
    distances  99th percentile and largest distance from the iso-surface of each level, um
    volume     entry in volumes.json; None: no volume
    files      all files of this channel and tile
    joint      joint histogram of the volume, packed, see bundle/write_transfer2d.py; None: no
               volume
    edit       message about edits of the surface by hand; empty: none
    objects    objects of a label map; None: the channel is no label map, or has no surface here
    """

    __pydantic_config__ = ConfigDict(ser_json_bytes="base64", val_json_bytes="base64")

    channel_id: str
    lods: tuple[TileLod, ...]
    triangles: tuple[int, ...]
    distances: tuple[tuple[float, float], ...]
    volume: dict[str, Any] | None
    files: tuple[FileRef, ...]
    joint: bytes | None
    edit: str = ""
    objects: PackedObjects | None = None


@dataclass(frozen=True, slots=True)
class BundleTile:
    """One tile in the bundle.

    low      lower corner (x, y, z) of the tile's box, world um
    high     upper corner of the box, like `low`
    changed  paths of the tile's layers that differ from the stage's list, relative to the stage
    name     display name; empty: none
    """

    id: str
    representation: Representation
    low: WorldPoint
    high: WorldPoint
    channels: tuple[TileChannel, ...]
    changed: tuple[str, ...] = ()
    name: str = ""


def write_file(root: Path, path: str, content: bytes) -> FileRef:
    """Write one file of a bundle, and return the reference to it. Raises OutputError."""
    write_bytes(root / path, content)
    return FileRef(path, len(content), hashlib.sha256(content).hexdigest())


@cache
def _records() -> TypeAdapter[BundleTile]:
    return TypeAdapter(BundleTile)


def part_of(parts: Path, tile_id: str, channel_id: str) -> Path:
    """Return the folder of the part for one channel of a tile."""
    return parts / tile_id / channel_id


def read_tile(parts: Path, tile_id: str, channel_ids: Iterable[str]) -> BundleTile:
    """Return a tile from the parts of its channels. Raises OutputError if files are missing."""
    own = [read_part(part_of(parts, tile_id, channel), tile_id) for channel in channel_ids]
    channels = tuple(channel for one in own for channel in one.channels)
    changed = tuple(sorted({name for one in own for name in one.changed}))
    return replace(own[0], channels=channels, changed=changed)


def read_part(part: Path, tile_id: str) -> BundleTile:
    """Return the tile, with the channels of a part. Raises OutputError if files are missing."""
    remedy = "run `stereocell bundle OUT` again"
    try:
        tile = _records().validate_python(read_json(part / _RECORD, None, remedy))
    except ValidationError:
        raise OutputError(f"{part / _RECORD}: damaged: {remedy}") from None
    sizes = sizes_of(part)
    refs = [ref for channel in tile.channels for ref in channel.files]
    # Files are moved by the paths in the record, so each path must be one of a file in this folder.
    if tile.id != tile_id or any(sizes.get(ref.path) != ref.bytes for ref in refs):
        raise OutputError(f"{part}: damaged: {remedy}")
    return tile


def write_record(root: Path, tile: BundleTile) -> None:
    """Write tile.json into the folder of a part. Raises OutputError."""
    write_json(root / _RECORD, _records().dump_python(tile, mode="json"))
