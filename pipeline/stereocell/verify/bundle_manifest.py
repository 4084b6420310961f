"""Compare a bundle's manifest with the stage: specimen, tiles and channels.

Each channel's transfer functions are compared, too: lookup tables, shapes and histograms.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from stereocell.bundle.manifest import read_manifest
from stereocell.bundle.write_transfer2d import sum_tiles
from stereocell.transfer.joint_histogram import log_scaled
from stereocell.transfer.opacity import evaluate
from stereocell.usd.composed_appearance import ComposedAppearance
from stereocell.usd.read_appearances import read_appearances
from stereocell.usd.read_provenance import fingerprint_of
from stereocell.usd.read_stage import modality_of, open_stage, specimen_name, tile_prims
from stereocell.verify.bundle_files import (
    COLOR_STEP,
    find_differences,
    read_texels,
    read_transfer2d,
)


def compare_manifest(stage_file: Path, bundle: Path) -> list[str]:
    """Return the differences between the manifest and the composed stage.

    Raises StereoCellError if one of them can't be read.
    """
    stage = open_stage(stage_file)
    manifest = read_manifest(bundle)
    specimen = {"name": specimen_name(stage), "modality": modality_of(stage)}
    if fingerprint := fingerprint_of(stage):
        specimen["fingerprint"] = fingerprint
    problems = list(find_differences("specimen", manifest["specimen"], specimen))
    tiles = [str(prim.GetName()) for prim in tile_prims(stage)]
    listed = [tile["id"] for tile in manifest["tiles"]]
    if tiles != listed:
        problems.append(
            f"tiles are {', '.join(listed)}, expected {', '.join(tiles)} as in the stage"
        )
    ends = [
        [pick(tile["bounds_um"][end][axis] for tile in manifest["tiles"]) for axis in range(3)]
        for end, pick in (("min", min), ("max", max))
    ]
    whole = {"bounds_um": dict(zip(("min", "max"), ends, strict=True))}
    problems += find_differences("specimen", manifest["specimen"], whole, "its tiles")
    appearances = read_appearances(stage)
    ids = [appearance.id for appearance in appearances]
    found = [channel["id"] for channel in manifest["channels"]]
    if ids != found:
        words = f"channels are {', '.join(found)}, expected {', '.join(ids)} as in the stage"
        return [*problems, words]
    for appearance, channel in zip(appearances, manifest["channels"], strict=True):
        problems += _compare_channel(appearance, channel, bundle)
    return problems


def _compare_channel(
    appearance: ComposedAppearance, channel: dict[str, Any], bundle: Path
) -> Iterator[str]:
    away = max(abs(a - b) for a, b in zip(appearance.color, channel["color"], strict=True))
    if away > COLOR_STEP:
        yield (
            f"{appearance.id}: color is {channel['color']}, expected {list(appearance.color)} as "
            "in the stage"
        )
    level = appearance.level
    expected = {
        "name": appearance.name,
        "window": list(appearance.window),
        "iso_value": appearance.iso_value,
        "iso_normalized": appearance.iso_normalized,
        "threshold_normalized": appearance.threshold_normalized,
        "surface": "none" if channel["tileset"] is None else appearance.surface,
        "surface_reason": appearance.surface_reason,
        "level": None if level is None else json.loads(json.dumps(asdict(level))),
        "transfer_function": appearance.chosen,
        "transfer_functions": list(appearance.transfer_functions),
    }
    yield from find_differences(appearance.id, channel, expected)
    yield from find_differences(
        appearance.id,
        channel["transfer_functions_2d"],
        {"names": list(appearance.transfer_2d.functions)},
    )
    shapes = read_transfer2d(bundle, channel)
    drawn = json.loads(json.dumps(asdict(appearance.transfer_2d)))
    yield from find_differences(appearance.id, shapes, drawn)
    rows = read_texels(bundle / channel["lut"]["path"])[0][0]
    if rows.shape != (len(appearance.transfer_functions), 256, 4):
        shape = " x ".join(map(str, rows.shape))
        yield (
            f"{appearance.id}: found a lookup table of {shape} values, expected "
            f"{len(appearance.transfer_functions)} x 256 x 4"
        )
        return
    for row, (name, points) in zip(rows, appearance.transfer_functions.items(), strict=True):
        off = np.abs(row[:, 3] / 255 - evaluate(points)).max()
        if (row[:, :3] != 255).any() or off > COLOR_STEP:
            yield f"{appearance.id}: the lookup table of {name!r} differs from the stage"


def compare_histograms(bundle: Path, joints: Sequence[Mapping[str, bytes]]) -> Iterator[str]:
    """Yield a problem for each channel whose joint histogram differs from its volumes.

    joints  for each tile, packed joint histograms of value and gradient by channel
    """
    manifest = read_manifest(bundle)
    for channel in manifest["channels"]:
        name = channel["id"]
        counts = sum_tiles(tile[name] for tile in joints if name in tile)
        shapes = read_transfer2d(bundle, channel)
        expected = log_scaled(counts)
        found = read_texels(bundle / shapes["histogram"]["path"])[0][0, ..., 0]
        if found.shape != expected.shape or (found != expected).any():
            yield f"{name}: its histogram of value and gradient differs from its volumes"
        yield from find_differences(name, shapes, {"most": int(counts.max())}, "its volumes")
