"""Describe one channel's surfaces as a 3D Tiles 1.1 tileset (OGC 22-025r4).

    root (no content)
      one child for each spatial tile: coarsest LOD -> ... -> lod0, each replacing the one before

Lengths are metres. Tilesets are z-up where glTF is y-up: readers turn glTF's (x, y, z) into
(x, -z, y), and the boxes here are turned the same way.

The extras of each content give its file's hash, so that a reader who trusts the tileset knows a
spoilt surface. 128 bits are enough for that, in base64url, named as RFC 6920 names them:
"sha-256-128". The first picture waits for a tileset, and hashes don't compress: the demo's three,
92 contents, were 27.0 kB (2.8 gzip), are 31.6 (4.8) and would be 35.0 (6.6) with 64 hexadecimal
digits each.
"""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from stereocell.write.generator import GENERATOR

_METRES_PER_UM = 1e-6
CONTENT_HASH = "sha-256-128"  # in the extras of a content
_CONTENT_HASH_BYTES = 16
_ROOT_ERROR = 100.0  # in diagonals of the channel: never small enough to draw nothing

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class TileLod:
    """One .glb: its address from the tileset, and the box (x, y, z) of its vertices in metres.

    sha256       of the file, hexadecimal
    distance_um  the LOD's measured distance from the finest surface
    """

    uri: str
    sha256: str
    distance_um: float
    min_m: Point
    max_m: Point


def content_hash(sha256: str) -> str:
    """Return what a content's extras say of a file with this SHA-256 (hexadecimal)."""
    start = bytes.fromhex(sha256)[:_CONTENT_HASH_BYTES]
    return base64.urlsafe_b64encode(start).rstrip(b"=").decode()


def make_tileset(tiles: Sequence[Sequence[TileLod]]) -> dict[str, Any]:
    """Return tileset.json's content; each tile's LODs finest first, at least one each.

    A coarser LOD never gets a smaller geometricError than a finer one: readers ask for that.
    """
    every = [lod for lods in tiles for lod in lods]
    low, high = _union(every)
    diagonal = sum((b - a) ** 2 for a, b in zip(low, high, strict=True)) ** 0.5
    error = max(_ROOT_ERROR * diagonal, *(lod.distance_um * _METRES_PER_UM for lod in every))
    return {
        "asset": {"version": "1.1", "extras": {"generator": GENERATOR}},
        "geometricError": error,
        "root": {
            "boundingVolume": {"box": _box(low, high)},
            "geometricError": error,
            "refine": "REPLACE",
            "children": [_chain(lods) for lods in tiles],
        },
    }


def _chain(lods: Sequence[TileLod]) -> dict[str, Any]:
    box = _box(*_union(lods))  # a tile's box holds its children's
    tile: dict[str, Any] = {}
    error = 0.0
    for k, lod in enumerate(lods):
        error = max(error, lod.distance_um * _METRES_PER_UM) if k else 0.0
        coarser: dict[str, Any] = {
            "boundingVolume": {"box": box},
            "geometricError": error,
            "refine": "REPLACE",
            "content": {"uri": lod.uri, "extras": {CONTENT_HASH: content_hash(lod.sha256)}},
        }
        if k:
            coarser["children"] = [tile]
        tile = coarser
    return tile


def _union(lods: Sequence[TileLod]) -> tuple[Point, Point]:
    lows, highs = zip(*((lod.min_m, lod.max_m) for lod in lods), strict=True)
    x0, y0, z0 = (min(axis) for axis in zip(*lows, strict=True))
    x1, y1, z1 = (max(axis) for axis in zip(*highs, strict=True))
    return (x0, y0, z0), (x1, y1, z1)


def _box(low: Point, high: Point) -> list[float]:
    """Return centre and half axes, z up, of a box given y up."""
    cx, cy, cz = ((a + b) / 2 for a, b in zip(low, high, strict=True))
    hx, hy, hz = ((b - a) / 2 for a, b in zip(low, high, strict=True))
    return [cx, -cz, cy, hx, 0.0, 0.0, 0.0, hz, 0.0, 0.0, 0.0, hy]
