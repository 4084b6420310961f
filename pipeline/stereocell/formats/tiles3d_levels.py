"""Remove finer levels from a tileset of `tiles3d.make_tilesets`."""

import re
from collections.abc import Callable, Iterator
from pathlib import PurePosixPath
from typing import Any

Tile = dict[str, Any]
_LOD = re.compile(r"lod(\d+)\.glb$")


def is_surface(path: str) -> bool:
    """Return whether a path is that of a surface at some level of detail, such as lod1.glb."""
    return _LOD.search(path) is not None


def surfaces(tile: Tile) -> Iterator[tuple[str, int]]:
    """Yield the address and the level of detail of each surface of a tile and its descendants."""
    uri = tile.get("content", {}).get("uri", "")
    if found := _LOD.search(uri):
        yield uri, int(found[1])
    for child in tile.get("children", ()):
        yield from surfaces(child)


def inlined(tile: Tile, read: Callable[[str], Tile], below: str = "") -> Tile:
    """Return a tile in which each reference to a nested tileset is replaced by that tileset's root.

    read  returns the root of the tileset at an address
    """
    uri = tile.get("content", {}).get("uri", "")
    if uri.endswith(".json"):
        root = {key: value for key, value in read(below + uri).items() if key != "refine"}
        return inlined(root, read, f"{below}{PurePosixPath(uri).parent}/")
    made = dict(tile)
    if uri:
        made["content"] = {**tile["content"], "uri": below + uri}
    if "children" in tile:
        made["children"] = [inlined(child, read, below) for child in tile["children"]]
    return made


def without_finer(tile: Tile, finest: int) -> Tile:
    """Return a tile of a tileset without surfaces finer than a level. Its own surface stays."""
    children = tile.get("children", [])
    if "content" in tile:
        children = [one for one in children if any(lod >= finest for _, lod in surfaces(one))]
    made = {key: value for key, value in tile.items() if key != "children"}
    if children:
        return {**made, "children": [without_finer(one, finest) for one in children]}
    return {**made, "geometricError": 0.0}  # nothing finer replaces it
