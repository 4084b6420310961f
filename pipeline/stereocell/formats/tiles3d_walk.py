"""Walk through the tilesets of a bundle, and the external tilesets that they name."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stereocell.model.errors import CheckError
from stereocell.storage.json_files import read_json

_JSON = ".json"
# Largest number of characters of an address; no file system has longer names
_MAX_CHARACTERS = 1024
_REMEDY = "run `stereocell bundle OUT`"


@dataclass(frozen=True, slots=True)
class Content:
    """A file that a tileset names: a surface, or an external tileset.

    tileset  the JSON file that names this file
    path     path of this file in the bundle
    named    entry in that file: `uri`, `extras`
    error_m  geometricError of the tile that has this content, metres
    limit_m  geometricError of the tile's parent, metres
    boxes    boxes of the tile, its parent and so on: 12 numbers each, metres, z up
    """

    tileset: Path
    path: Path
    named: dict[str, Any]
    error_m: float
    limit_m: float
    boxes: tuple[tuple[float, ...], ...]

    @property
    def is_tileset(self) -> bool:
        """Whether the file is an external tileset."""
        return self.path.suffix == _JSON


def walk(bundle: Path, tileset: Path, tile_id: str | None = None) -> Iterator[Content]:
    """Yield each content of a tileset, and of the tilesets that it names, coarse ones first.

    bundle   folder that must contain all files
    tile_id  only files in this tile's folder are yielded; None: all files

    An external tileset is yielded before it is opened. Raises StereoCellError, which names the
    file, if a tileset is missing or invalid, names a file outside of `bundle`, or names a tileset
    that was already visited.
    """
    place = _place(tileset)
    yield from _walk_file(_place(bundle), tileset, tile_id, None, (), {place})


def _walk_file(
    bundle: Path,
    tileset: Path,
    tile_id: str | None,
    parent_m: float | None,
    around: tuple[tuple[float, ...], ...],
    visited: set[Path],
) -> Iterator[Content]:
    content = read_json(tileset, None, _REMEDY)
    try:
        whole_m = content["geometricError"]
        most_m = float(whole_m) if parent_m is None else min(float(whole_m), parent_m)
        waiting = [(content["root"], most_m, around)]
        while waiting:
            tile, limit_m, holding = waiting.pop()
            error_m = float(tile["geometricError"])
            if "transform" in tile:
                raise CheckError(
                    f"{tileset}: found a tile with a transform, expected none: surfaces are in "
                    "world space"
                )
            boxes = (tuple(float(n) for n in tile["boundingVolume"]["box"]), *holding)
            waiting += [(child, error_m, boxes) for child in reversed(tile.get("children", ()))]
            if "content" not in tile:
                continue
            uri = tile["content"]["uri"]
            if len(uri) > _MAX_CHARACTERS:
                raise CheckError(
                    f"{tileset}: {uri:.80}... is too long, expected up to {_MAX_CHARACTERS} "
                    "characters"
                )
            path = tileset.parent / uri
            place = _place(path)
            if not place.is_relative_to(bundle):
                raise CheckError(f"{tileset}: {uri} is outside the bundle")
            if tile_id is not None and place.parent.name != tile_id:
                continue
            found = Content(tileset, path, tile["content"], error_m, limit_m, boxes)
            yield found
            if found.is_tileset:
                if place in visited:
                    raise CheckError(f"{tileset}: {uri} is a tileset that was named before")
                visited.add(place)
                yield from _walk_file(bundle, path, tile_id, error_m, boxes, visited)
    except (AttributeError, KeyError, OSError, TypeError, ValueError) as error:
        raise CheckError(f"{tileset}: not a 3D Tiles tileset: {error!r:.200}") from error


def _place(path: Path) -> Path:
    """Return the path without links; if links form a circle, some path."""
    return Path(os.path.realpath(path))
