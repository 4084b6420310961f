"""The part of a bundle that one tile brings: its record, and the references to its files.

A tile's part is a folder that holds its files under their names in the bundle, and tile.json, which
says what the bundle's own files need to know of it.
"""

import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, TypeAdapter, ValidationError

from stereocell.formats.tiles3d import TileLod
from stereocell.model.errors import OutputError
from stereocell.model.tile_content import Representation
from stereocell.model.world_box import WorldPoint
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.file_list import sizes_of
from stereocell.storage.json_files import read_json, write_json

_RECORD = "tile.json"


@dataclass(frozen=True, slots=True)
class FileRef:
    """A file of the bundle. `path` is relative to its root, with forward slashes."""

    path: str
    bytes: int
    sha256: str


@dataclass(frozen=True, slots=True)
class PackedObjects:
    """The objects of one tile: little-endian arrays as bytes.

    labels    uint64 (n,)
    names     by object; empty: there are none
    values    float32 (n,) by column ID
    boxes     float32 (n, 6): least and largest (x, y, z), world um
    touching  uint64 (m, 2), labels of objects that share a wall
    wall_um2  float32 (m,), its area; NaN: not known
    """

    __pydantic_config__ = ConfigDict(ser_json_bytes="base64", val_json_bytes="base64")

    labels: bytes
    names: tuple[str, ...]
    values: dict[str, bytes]
    boxes: bytes
    touching: bytes
    wall_um2: bytes


@dataclass(frozen=True, slots=True)
class TileChannel:
    """One (tile, channel) in the bundle.

    lods       for the tileset, finest first; addresses relative to it
    triangles  by level of detail; levels finer than the finest have as many as that
    distances  by level, too: the stated and the largest distance from the iso-surface, um
    volume     its entry in volumes.json, or None
    files      all that was written
    joint      the volume's histogram of value and gradient, packed; see bundle/write_transfer2d.py
    objects    of a label map's tile; None: it has none
    edit       what was edited by hand of its surface, and what follows from that; or empty
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

    low      corner (x, y, z) of its box in the world, um
    high     the opposite corner
    name     for people; empty: the stage has none
    changed  paths of its layers that differ from the stage's list, from the stage's folder
    """

    id: str
    representation: Representation
    low: WorldPoint
    high: WorldPoint
    channels: tuple[TileChannel, ...]
    changed: tuple[str, ...] = ()
    name: str = ""


def write_file(root: Path, path: str, content: bytes) -> FileRef:
    """Write one file of a bundle. Raises OutputError."""
    write_bytes(root / path, content)
    return FileRef(path, len(content), hashlib.sha256(content).hexdigest())


@cache
def _records() -> TypeAdapter[BundleTile]:
    return TypeAdapter(BundleTile)


def read_part(part: Path) -> BundleTile:
    """Return the tile whose part lies in a folder. Raises OutputError where it isn't whole."""
    remedy = "run `stereocell bundle OUT` again"
    try:
        tile = _records().validate_python(read_json(part / _RECORD, None, remedy))
    except ValidationError:
        raise OutputError(f"{part / _RECORD}: damaged: {remedy}") from None
    sizes = sizes_of(part)
    refs = [ref for channel in tile.channels for ref in channel.files]
    # by these names files are moved: they must be of this folder
    if tile.id != part.name or any(sizes.get(ref.path) != ref.bytes for ref in refs):
        raise OutputError(f"{part}: damaged: {remedy}")
    return tile


def write_record(root: Path, tile: BundleTile) -> None:
    """Write the record of a tile's part into its folder. Raises OutputError."""
    write_json(root / _RECORD, _records().dump_python(tile, mode="json"))
