"""Describe one channel's surfaces as a 3D Tiles 1.1 tileset (OGC 22-025r4).

    root (no content)
      one child for each spatial tile: coarsest LOD -> ... -> lod0, each replacing the one before

Lengths are metres. Tilesets are z-up and glTF is y-up: readers turn glTF's (x, y, z) into
(x, -z, y), and the boxes here are turned in the same way.

The extras of each content hold its file's hash, so that a reader that trusts the tileset detects a
damaged surface. The hash has 128 bits in base64url. Its name is that of RFC 6920: "sha-256-128".

The first image needs only manifest.json, one tileset, and the coarsest LODs. If there are many
tiles, the finer LODs of each are therefore in a separate tileset, `<tile>/finer.json`. A reader
fetches it when it needs the first of them. Few tiles are one file, and so one request. Numbers are
rounded, boxes outwards and errors upwards. With all this, 242 tiles of four LODs take 112 kB
instead of 328.
"""

import base64
import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import ROUND_CEILING, Context
from itertools import accumulate, pairwise
from pathlib import PurePosixPath
from typing import Any

from stereocell.model.version import GENERATOR
from stereocell.storage.json_files import compact_json

_METRES_PER_UM = 1e-6
_NM_PER_METRE = 1e9
CONTENT_HASH = "sha-256-128"  # key in the extras of a content
_CONTENT_HASH_BYTES = 16
# Error of the root tile (geometricError), as a multiple of the diagonal of the channel's box. It is
# so large that readers always draw at least the coarsest LODs.
_ROOT_ERROR = 100.0
# Largest number of tiles that one file describes with all LODs; 59 kB with four LODs each
MAX_WHOLE_TILES = 64
TILESET = "tileset.json"
_FINER = "finer.json"
_UPWARDS = Context(prec=4, rounding=ROUND_CEILING)  # rounds up to four digits

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class TileLod:
    """One .glb: its address from the tileset, and the box of its vertices.

    uri           `<tile>/<name>.glb`
    sha256        SHA-256 of the file, hexadecimal
    largest_um    largest measured distance between the LOD and the iso-surface
    min_m, max_m  corners of the box (x, y, z), metres, y up
    """

    uri: str
    sha256: str
    largest_um: float
    min_m: Point
    max_m: Point


def content_hash(sha256: str) -> str:
    """Return the hash for a content's extras, from the SHA-256 of its file (hexadecimal)."""
    start = bytes.fromhex(sha256)[:_CONTENT_HASH_BYTES]
    return base64.urlsafe_b64encode(start).rstrip(b"=").decode()


def make_tilesets(tiles: Sequence[Sequence[TileLod]]) -> dict[str, bytes]:
    """Return a channel's JSON files by address.

    tiles  the LODs of each tile, finest first, at least one each

    Up to MAX_WHOLE_TILES tiles, `tileset.json` is the only file. With more tiles it refers to the
    others. A coarser LOD never has a smaller geometricError than a finer one, as readers require.
    """
    boxes = [_Box.around(lods) for lods in tiles]
    whole = _Box.holding(boxes)
    farthest_um = max(lod.largest_um for lods in tiles for lod in lods)
    error = _round_up(max(_ROOT_ERROR * whole.diagonal_m, farthest_um * _METRES_PER_UM))
    files: dict[str, bytes] = {}
    children = []
    for lods, box in zip(tiles, boxes, strict=True):
        folder = PurePosixPath(lods[0].uri).parent
        if len(tiles) <= MAX_WHOLE_TILES or len(lods) == 1:
            children.append(_nested(_levels(lods, box)))
            continue
        *finer, coarsest = _levels(lods, box)
        for tile in finer:
            tile["content"]["uri"] = PurePosixPath(tile["content"]["uri"]).name
        address = f"{folder}/{_FINER}"
        files[address] = compact_json(_tileset(_nested(finer), coarsest["geometricError"]))
        sha256 = hashlib.sha256(files[address]).hexdigest()
        # This tile has no surface of its own. The LODs of its JSON file replace the coarsest one.
        holder = _tile(box, coarsest["geometricError"], address, sha256)
        children.append(_nested([holder, coarsest]))
    root = {
        "boundingVolume": {"box": whole.numbers()},
        "geometricError": error,
        "children": children,
    }
    return {TILESET: compact_json(_tileset(root, error)), **files}


def _tileset(root: dict[str, Any], error: float) -> dict[str, Any]:
    return {
        "asset": {"version": "1.1", "extras": {"generator": GENERATOR}},
        "geometricError": error,
        "root": {**root, "refine": "REPLACE"},  # all tiles below the root inherit `refine`
    }


def _levels(lods: Sequence[TileLod], box: "_Box") -> list[dict[str, Any]]:
    """Return a tile of the tileset for each LOD, finest first, without children."""
    errors = accumulate((_round_up(lod.largest_um * _METRES_PER_UM) for lod in lods[1:]), max)
    return [
        _tile(box, error, lod.uri, lod.sha256)
        for lod, error in zip(lods, (0.0, *errors), strict=True)
    ]


def _tile(box: "_Box", error: float, uri: str, sha256: str) -> dict[str, Any]:
    return {
        "boundingVolume": {"box": box.numbers()},
        "geometricError": error,
        "content": {"uri": uri, "extras": {CONTENT_HASH: content_hash(sha256)}},
    }


def _nested(tiles: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the last tile, with each tile as the child of the next."""
    for finer, coarser in pairwise(tiles):
        coarser["children"] = [finer]
    return tiles[-1]


@dataclass(frozen=True, slots=True)
class _Box:
    """Corners (x, y, z), y up, in whole nm. Edges are even, so that the centre is whole too."""

    low: tuple[int, ...]
    high: tuple[int, ...]

    @classmethod
    def around(cls, lods: Sequence[TileLod]) -> "_Box":
        """Return the box of all LODs, rounded outwards; it must contain the boxes of children."""
        lows = zip(*(lod.min_m for lod in lods), strict=True)
        highs = zip(*(lod.max_m for lod in lods), strict=True)
        return cls._evened(
            [math.floor(min(axis) * _NM_PER_METRE) for axis in lows],
            [math.ceil(max(axis) * _NM_PER_METRE) for axis in highs],
        )

    @classmethod
    def holding(cls, boxes: Sequence["_Box"]) -> "_Box":
        """Return the box that contains all of these boxes."""
        return cls._evened(
            [min(axis) for axis in zip(*(box.low for box in boxes), strict=True)],
            [max(axis) for axis in zip(*(box.high for box in boxes), strict=True)],
        )

    @classmethod
    def _evened(cls, low: Sequence[int], high: Sequence[int]) -> "_Box":
        return cls(tuple(low), tuple(b + (b - a) % 2 for a, b in zip(low, high, strict=True)))

    @property
    def diagonal_m(self) -> float:
        """The length of the diagonal in metres."""
        return math.dist(self.low, self.high) / _NM_PER_METRE

    def numbers(self) -> list[float]:
        """Return centre and half axes in metres, z up, 12 numbers."""
        centre = [(a + b) // 2 for a, b in zip(self.low, self.high, strict=True)]
        half = [(b - a) // 2 for a, b in zip(self.low, self.high, strict=True)]
        cx, cy, cz = (n / _NM_PER_METRE for n in centre)  # in metres, whole nm give short decimals
        hx, hy, hz = (n / _NM_PER_METRE for n in half)
        return [cx, 0 - cz, cy, hx, 0, 0, 0, hz, 0, 0, 0, hy]


def _round_up(error: float) -> float:
    """Return the error with four significant digits, never smaller than given."""
    return float(_UPWARDS.create_decimal(repr(error)))
