"""Read the files of a bundle without its finer levels, for a scene in one file.

The result is a complete bundle with fewer levels. Its lists have the remaining files with their
hashes. Surfaces keep the names of their levels: lod2.glb stays lod2.glb.
"""

import gzip
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cached_property
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import Any

from stereocell.bundle.blob_page import find_page
from stereocell.bundle.manifest import FILES, MANIFEST, REMEDY, read_manifest
from stereocell.formats.ktx2 import without_finest
from stereocell.formats.tiles3d_levels import inlined, is_surface, surfaces, without_finer
from stereocell.model.errors import OutputError, UsageError
from stereocell.storage.file_list import encode, is_same, read_list, to_json
from stereocell.storage.json_files import compact_json, read_json, sealed

_PACKS = {".json", ".glb", ".bin", ".hdr"}  # suffixes that gzip makes smaller
_NO_USDZ = "a scene in one file has none"


@dataclass(frozen=True, slots=True)
class Packed:
    """The bytes of a file for a scene in one file, as gzip or unchanged."""

    data: bytes
    is_packed: bool


def pack(path: str, data: bytes) -> Packed:
    """Return a file's bytes, as gzip if that is shorter. The same input gives the same bytes."""
    if PurePosixPath(path).suffix in _PACKS:
        small = gzip.compress(data, 9, mtime=0)
        if len(small) < len(data):
            return Packed(small, True)
    return Packed(data, False)


@dataclass(frozen=True, slots=True)
class Levels:
    """The finest levels that are kept, 0: all levels. A tile always keeps its coarsest level.

    surfaces  level of detail
    volumes   mip level
    """

    surfaces: int
    volumes: int


class SceneFiles:
    """The files of a bundle, with a selection of channels.

    Raises OutputError if the bundle is damaged, and UsageError for an unknown channel.
    """

    def __init__(self, bundle: Path, channels: Sequence[str] = ()) -> None:
        self._root = bundle.resolve()
        self._manifest = read_manifest(self._root)
        self._listed = read_list(self._root / FILES, REMEDY)
        self.channels = self._chosen(channels)
        self._packed: dict[str, Packed] = {}
        self._trusted: set[str] = set()  # paths of files whose hashes were found correct

    def _chosen(self, wanted: Sequence[str]) -> list[dict[str, Any]]:
        found = self._manifest["channels"]
        for name in wanted:
            if not any(name in (one["name"], one["id"]) for one in found):
                known = ", ".join(one["name"] for one in found)
                raise UsageError(f"--channels names {name!r}, expected one or more of {known}")
        return [one for one in found if not wanted or {one["name"], one["id"]} & set(wanted)]

    @property
    def has_usdz(self) -> bool:
        """Whether the bundle has a specimen.usdz. A page in one file leaves it out."""
        return self._manifest.get("usdz") is not None

    @cached_property
    def _tilesets(self) -> dict[str, dict[str, Any]]:
        """The tileset of each channel with surfaces. Nested tilesets are inlined."""
        refs = {one["id"]: one["tileset"] for one in self.channels if one["tileset"] is not None}
        return {id_: self._whole_tileset(ref["path"]) for id_, ref in refs.items()}

    @cached_property
    def _volumes(self) -> dict[str, dict[str, Any]]:
        return {one["id"]: self._json(one["volumes"]["path"]) for one in self.channels}

    @property
    def surface_levels(self) -> int:
        """The largest number of levels of detail of a surface; 0: there are no surfaces."""
        roots = (tileset["root"] for tileset in self._tilesets.values())
        return max((lod + 1 for root in roots for _, lod in surfaces(root)), default=0)

    @property
    def volume_levels(self) -> int:
        """The largest number of mip levels of a volume; 0: there are no volumes."""
        return max((len(one["levels"]) for one in self._volume_entries()), default=0)

    def largest_volume(self, levels: Levels) -> tuple[int, int, int]:
        """Return the size in voxels (x, y, z) of the largest volume at its finest kept level."""
        sizes = [_kept(entry, levels.volumes)[0]["size"] for entry in self._volume_entries()]
        x, y, z = max(sizes, key=lambda size: (size[0] * size[1] * size[2], size))
        return x, y, z

    def least_bytes(self, levels: Levels) -> int:
        """Return a lower bound for the size of the files at some levels, without reading them."""
        frames = (
            level["length"]
            for entry in self._volume_entries()
            for level in _kept(entry, levels.volumes)
        )
        meshes = (
            self._listed[f"channels/{id_}/{uri}"]["bytes"]
            for id_, tileset in self._tilesets.items()
            for uri, _ in surfaces(without_finer(tileset["root"], levels.surfaces))
        )
        return sum(frames) + sum(meshes) // 4  # gzip leaves more than a quarter of a .glb

    def at(self, levels: Levels) -> dict[str, Packed]:
        """Return all files by path: the bundle's without finer levels, and environment maps."""
        made: dict[str, bytes | None] = {}
        manifest = {**self._manifest, "channels": [], "usdz": None, "usdz_reason": _NO_USDZ}
        for channel in self.channels:
            files, entry = self._channel(channel, levels)
            made |= files
            manifest["channels"].append(entry)
        listed = {path: _entry(data) for path, data in made.items() if data is not None}
        listed |= {path: dict(self._listed[path]) for path, data in made.items() if data is None}
        index = made[FILES] = encode(listed)
        manifest["files"] = {"path": FILES, **_entry(index)}
        made[MANIFEST] = to_json(sealed(manifest))
        lights = sorted((find_page() / "environments").glob("*.hdr"))
        made |= {f"environments/{file.name}": file.read_bytes() for file in lights}
        return {
            path: self._read_packed(path) if data is None else pack(path, data)
            for path, data in sorted(made.items())
        }

    def _channel(
        self, channel: dict[str, Any], levels: Levels
    ) -> tuple[dict[str, bytes | None], dict[str, Any]]:
        """Return a channel's files by path, and its entry in the manifest.

        The content is None for a file that does not differ from that of the bundle.
        """
        id_, entry = channel["id"], dict(channel)
        files: dict[str, bytes | None] = {channel["lut"]["path"]: None}
        folder = f"channels/{id_}/"
        external = f"{folder}*/finer.json"  # nested tilesets, which are inlined in the tileset
        for path in self._listed:
            if fnmatch(path, external):
                continue
            if path.startswith(folder) and not is_surface(path):
                files[path] = None
        if id_ in self._tilesets:
            tileset = self._tilesets[id_]
            root = without_finer(tileset["root"], levels.surfaces)
            files |= {folder + uri: None for uri, _ in surfaces(root)}
            path = channel["tileset"]["path"]
            document = files[path] = compact_json({**tileset, "root": root})
            entry["tileset"] = {"path": path, **_entry(document)}
            for name in {"triangles", "distances"} & channel.keys():
                entry[name] = channel[name][min(levels.surfaces, len(channel[name]) - 1) :]
        path = channel["volumes"]["path"]
        entries = []
        for volume in self._volumes[id_]["volumes"]:
            made, texture = self._volume(volume, levels.volumes)
            files |= {volume["file"]["path"]: texture, volume["bricks"]["path"]: None}
            entries.append(made)
        document = files[path] = compact_json({"volumes": entries})
        entry["volumes"] = {"path": path, **_entry(document)}
        return files, entry

    def _volume(self, volume: dict[str, Any], finest: int) -> tuple[dict[str, Any], bytes | None]:
        """Return a volume's entry and texture without the levels finer than `finest`.

        The texture is None if it does not differ from that of the bundle.
        """
        kept = _kept(volume, finest)
        if len(kept) == len(volume["levels"]):
            return volume, None
        path = volume["file"]["path"]
        texture = without_finest(self._read(path), len(volume["levels"]) - len(kept))
        levels = [
            {**level, "offset": place.offset}
            for level, place in zip(kept, texture.levels, strict=True)
        ]
        file = {"path": path, **_entry(texture.data)}
        return {**volume, "file": file, "levels": levels}, texture.data

    def _volume_entries(self) -> Iterator[dict[str, Any]]:
        for content in self._volumes.values():
            yield from content["volumes"]

    def _whole_tileset(self, path: str) -> dict[str, Any]:
        """Return a tileset in which nested tilesets are inlined."""
        content = self._json(path)
        folder = PurePosixPath(path).parent
        root = inlined(content["root"], lambda uri: self._json(f"{folder}/{uri}")["root"])
        return {**content, "root": root}

    def _json(self, path: str) -> dict[str, Any]:
        self._require(path)
        content: dict[str, Any] = read_json(self._root / path, None, REMEDY)
        return content

    def _read(self, path: str) -> bytes:
        self._require(path)
        return (self._root / path).read_bytes()

    def _read_packed(self, path: str) -> Packed:
        if path not in self._packed:
            self._packed[path] = pack(path, self._read(path))
        return self._packed[path]

    def _require(self, path: str) -> None:
        """Raise OutputError if a file is missing or differs from the bundle's list."""
        if path in self._trusted:
            return
        file = self._root / path
        if path not in self._listed or not file.is_file():
            raise OutputError(
                f"{file}: missing from the bundle, expected the file in {FILES}: {REMEDY}"
            )
        if not is_same(file, self._listed[path]):
            raise OutputError(f"{file}: its size or hash differs from {FILES}: {REMEDY}")
        self._trusted.add(path)


def _entry(data: bytes) -> dict[str, Any]:
    return {"bytes": len(data), "sha256": sha256(data).hexdigest()}


def _kept(volume: dict[str, Any], finest: int) -> list[dict[str, Any]]:
    levels: list[dict[str, Any]] = volume["levels"]
    return levels[min(finest, len(levels) - 1) :]
