"""Write the files that a channel has once for all tiles of a bundle, and the manifest's entries."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from stereocell.bundle.tile_part import BundleTile, FileRef, TileChannel, write_file
from stereocell.bundle.write_transfer2d import describe, encode_histogram, sum_tiles
from stereocell.formats.ktx2 import encode_2d
from stereocell.formats.tiles3d import make_tilesets
from stereocell.model.version import GENERATOR
from stereocell.storage.file_list import to_json
from stereocell.storage.json_files import compact_json, sealed
from stereocell.transfer.opacity import evaluate
from stereocell.usd.composed_appearance import ComposedAppearance
from stereocell.usd.read_views import StageView


def describe_bundle(
    specimen: dict[str, Any],
    tiles: Sequence[BundleTile],
    *,
    channels: Sequence[dict[str, Any]],
    index: FileRef,
    more: Mapping[str, Any] | None = None,
    unfinished: Collection[str] = (),
    views: Sequence[StageView] = (),
) -> bytes:
    """Return the content of manifest.json, including its hash.

    specimen    name, modality, fingerprint of the source, directions to a patient's sides
    channels    entries, as `describe_channel` returns them
    index       reference to files.json
    more        entries for specimen.usdz, or the reason why there is none, and for additions and
                lights of layers; None: the manifest has no such entries
    unfinished  IDs of tiles whose surfaces are not built yet, so that their volumes are shown
    views       named views, from cameras that a layer adds to the stage
    """
    manifest = {
        "format": "stereocell-bundle",
        "version": 1,
        "generator": GENERATOR,
        "specimen": {**specimen, "bounds_um": _bounds(tiles)},
        "tiles": [
            {
                "id": tile.id,
                **({"name": tile.name} if tile.name else {}),
                "representation": tile.representation,
                "bounds_um": _bounds([tile]),
                **({"unfinished": True} if tile.id in unfinished else {}),
            }
            for tile in tiles
        ],
        "channels": channels,
        **({"views": [_describe_view(view) for view in views]} if views else {}),
        **(more or {}),
        "files": asdict(index),
    }
    return to_json(sealed(manifest))


def _describe_view(view: StageView) -> dict[str, Any]:
    return {
        "name": view.name,
        "position_um": list(view.position),
        "target_um": list(view.target),
        "fov_deg": view.fov_deg,
    }


def write_channel(
    root: Path, appearance: ComposedAppearance, tiles: Sequence[tuple[str, TileChannel]]
) -> tuple[dict[str, Any], list[FileRef]]:
    """Write a channel's files that cover all tiles; return its manifest entry, and the files."""
    folder = f"channels/{appearance.id}"
    drawn = [channel.lods for _, channel in tiles if channel.lods]
    tilesets = [
        write_file(root, f"{folder}/{address}", content)
        for address, content in (make_tilesets(drawn) if drawn else {}).items()
    ]
    entries = [channel.volume for _, channel in tiles if channel.volume is not None]
    volumes = write_file(root, f"{folder}/volumes.json", compact_json({"volumes": entries}))
    lut = write_file(root, f"luts/{appearance.id}.ktx2", encode_2d(_bake(appearance)).data)
    counts = sum_tiles(channel.joint for _, channel in tiles if channel.joint is not None)
    histogram = write_file(root, f"{folder}/histogram2d.ktx2", encode_histogram(counts))
    joint = compact_json(describe(appearance, counts, asdict(histogram)))
    transfer2d = write_file(root, f"{folder}/transfer2d.json", joint)
    entry = describe_channel(
        appearance,
        [channel.triangles for _, channel in tiles],
        [channel.distances for _, channel in tiles],
        transfer2d=transfer2d,
        lut=lut,
        tileset=tilesets[0] if tilesets else None,
        volumes=volumes,
    )
    return entry, [*tilesets, volumes, lut, histogram, transfer2d]


def describe_channel(
    appearance: ComposedAppearance,
    triangles: Iterable[Sequence[int]],
    distances: Iterable[Sequence[tuple[float, float]]],
    *,
    transfer2d: FileRef,
    lut: FileRef,
    tileset: FileRef | None,
    volumes: FileRef,
) -> dict[str, Any]:
    """Return a channel's entry in the manifest.

    triangles  for each tile, the number of triangles at each level of detail
    distances  for each tile, the 99th percentile and the largest distance of each level, um
    """
    return {
        "id": appearance.id,
        "name": appearance.name,
        "color": list(appearance.color),
        "window": list(appearance.window),
        "iso_value": appearance.iso_value,
        "iso_normalized": appearance.iso_normalized,
        "threshold_normalized": appearance.threshold_normalized,
        "surface": "none" if tileset is None else appearance.surface,
        "surface_reason": appearance.surface_reason,
        "level": None if appearance.level is None else asdict(appearance.level),
        "opens": appearance.opens,
        "transfer_function": appearance.chosen,
        "transfer_functions": list(appearance.transfer_functions),
        "transfer_functions_2d": {
            "names": list(appearance.transfer_2d.functions),
            "file": asdict(transfer2d),
        },
        "lut": asdict(lut),
        "tileset": None if tileset is None else asdict(tileset),
        "triangles": _totals(triangles),
        "distances": _farthest(distances),
        "volumes": asdict(volumes),
    }


def _bake(appearance: ComposedAppearance) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return a row of 256 RGBA texels for each transfer function, uint8 (n, 256, 4)."""
    table = np.full((len(appearance.transfer_functions), 256, 4), 255, dtype=np.uint8)
    for row, points in zip(table, appearance.transfer_functions.values(), strict=True):
        row[:, 3] = np.rint(evaluate(points) * 255)
    return table


def _totals(tiles: Iterable[Sequence[int]]) -> list[int]:
    """Return the number of triangles of all tiles at each level of detail.

    A tile with fewer levels counts with its coarsest level.
    """
    given = [triangles for triangles in tiles if triangles]
    count = max((len(triangles) for triangles in given), default=0)
    return [sum(t[min(level, len(t) - 1)] for t in given) for level in range(count)]


def _farthest(tiles: Iterable[Sequence[tuple[float, float]]]) -> list[dict[str, float]]:
    """Return the largest distances, over all tiles, at each level of detail.

    A tile with fewer levels counts with its coarsest level.
    """
    given = [distances for distances in tiles if distances]
    count = max((len(distances) for distances in given), default=0)
    levels = ([d[min(level, len(d) - 1)] for d in given] for level in range(count))
    return [
        {"p99_um": max(p99 for p99, _ in level), "largest_um": max(most for _, most in level)}
        for level in levels
    ]


def _bounds(tiles: Sequence[BundleTile]) -> dict[str, list[float]]:
    return {
        "min": [min(tile.low[axis] for tile in tiles) for axis in range(3)],
        "max": [max(tile.high[axis] for tile in tiles) for axis in range(3)],
    }
