"""The sample `cycif`: a synthetic CyCIF block as OME-Zarr 0.5, and its ground truth."""

import json
import math
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from zarr.abc.buffer import Buffer
from zarr.codecs import ZstdCodec
from zarr.storage import MemoryStore

from stereocell.model.errors import OutputError, UsageError
from stereocell.model.tiling import Box
from stereocell.samples import microscope
from stereocell.samples.cycif_geometry import Tissue, grow_tissue
from stereocell.samples.microscope import BLUR_UM, SPACING_UM, STAINS
from stereocell.samples.place import EXPECTED, SAMPLE, find_group
from stereocell.storage.atomic_write import replacing, replacing_folder
from stereocell.storage.json_files import read_json
from stereocell.storage.overwriting import require_free

SUFFIX = ".ome.zarr"
_CHUNK = (1, 32, 128, 128)  # voxels (c, z, y, x), 1 MB
_COARSEST = 64  # voxels, longer side in y and x at which no coarser level is added


def write_cycif(
    path: Path,
    grid: tuple[int, int],
    *,
    tile_size: tuple[int, int, int],
    seed: int,
    brightness_spread: float,
) -> None:
    """Write the sample to `path` (NAME.ome.zarr) and its truth to NAME.truth.json beside it.

    grid               columns x rows of tiles
    tile_size          voxels (z, y, x)
    brightness_spread  brightness of the cells is log-uniform from 1 to 1 + this

    The voxels are uint16 (c, z, y, x). The same arguments give the same bytes; an existing equal
    sample stays. Raises UsageError for arguments out of range, OutputError if `path` holds other
    content or can't be written.
    """
    _check(path, grid, tile_size, seed, brightness_spread)
    depth, height, width = tile_size
    shape = (depth, grid[1] * height, grid[0] * width)
    size_um = tuple(n * h for n, h in zip(shape, SPACING_UM, strict=True))
    settings = {
        "grid": list(grid),
        "tile_size": list(tile_size),
        "seed": seed,
        "brightness_spread": brightness_spread,
    }
    attributes = _attributes(shape, settings)
    truth_path = path.with_name(path.name.removesuffix(SUFFIX) + ".truth.json")
    try:
        is_there = _is_there(path, attributes)
        if is_there and truth_path.exists():
            return
        _require_free(truth_path, settings)
        tissue = grow_tissue((size_um[0], size_um[1], size_um[2]), seed, brightness_spread)
        truth = json.dumps(_truth(tissue, shape, settings), indent=1) + "\n"
        is_same = truth_path.is_file() and truth_path.read_bytes() == truth.encode()
        require_free(truth_path, expected=EXPECTED, is_ours=is_same)
        with replacing(truth_path) as file:
            file.write_text(truth, encoding="utf-8", newline="\n")
            if not is_there:
                with replacing_folder(path) as folder:
                    _write_zarr(folder, tissue, shape, tile_size, attributes, seed)
    except OSError as error:
        raise OutputError(f"{path}: can't be written: {error.strerror or error}") from error


def _about(settings: dict[str, Any]) -> dict[str, Any]:
    """Return the sample's name and arguments for its volume and its truth."""
    return {"name": "cycif", **settings}


def _require_free(truth_path: Path, settings: dict[str, Any]) -> None:
    """Raise OutputError if another file lies at the truth's path, before the truth is computed.

    A truth is recognised by the sample's arguments in it.
    """
    try:
        found = read_json(truth_path, None, "")
    except OutputError:
        found = None
    is_ours = isinstance(found, dict) and found.get("sample") == _about(settings)
    require_free(truth_path, expected=EXPECTED, is_ours=is_ours)


def _check(
    path: Path,
    grid: tuple[int, int],
    tile_size: tuple[int, int, int],
    seed: int,
    brightness_spread: float,
) -> None:
    if not path.name.endswith(SUFFIX) or path.name == SUFFIX:
        raise UsageError(f"{path}: the sample is an OME-Zarr, expected a name like NAME{SUFFIX}")
    if min(grid) < 1:
        raise UsageError(f"--grid is {grid[0]}x{grid[1]}, expected columns x rows, at least 1x1")
    if min(tile_size) < 8:
        found = ",".join(map(str, tile_size))
        raise UsageError(f"--tile-size is {found}, expected z,y,x of at least 8 voxels each")
    if seed < 0:
        raise UsageError(f"--seed is {seed}, expected 0 or more")
    if not (math.isfinite(brightness_spread) and 0.0 <= brightness_spread <= 20.0):
        raise UsageError(f"--brightness-spread is {brightness_spread:g}, expected 0 to 20")


def _is_there(path: Path, attributes: dict[str, Any]) -> bool:
    if not path.exists():
        return False
    group = find_group(path)
    if group is None or group.attrs.asdict() != attributes:
        require_free(path, expected=EXPECTED)
        return False  # --force allows its replacement
    levels = [array for _, array in group.arrays()]
    return bool(levels) and all(level.nchunks == level.nchunks_initialized for level in levels)


def _level_shapes(shape: tuple[int, int, int]) -> list[tuple[int, int, int]]:
    shapes = [shape]
    while max(shapes[-1][1:]) > _COARSEST and min(shapes[-1][1:]) >= 2:
        depth, height, width = shapes[-1]
        shapes.append((depth, height // 2, width // 2))
    return shapes


def _attributes(shape: tuple[int, int, int], settings: dict[str, Any]) -> dict[str, Any]:
    """Return the attributes of the OME-Zarr 0.5 group."""
    axes: list[dict[str, str]] = [{"name": "c", "type": "channel"}]
    axes += [{"name": axis, "type": "space", "unit": "micrometer"} for axis in "zyx"]
    depth_um, height_um, width_um = SPACING_UM
    datasets = []
    for level in range(len(_level_shapes(shape))):
        factor = 2**level
        scale = [1.0, depth_um, height_um * factor, width_um * factor]
        shift = [0.0, 0.0, 0.5 * (factor - 1) * height_um, 0.5 * (factor - 1) * width_um]
        steps = [
            {"type": "scale", "scale": scale},
            {"type": "translation", "translation": shift},
        ]
        datasets.append({"path": str(level), "coordinateTransformations": steps})
    channels = [
        {
            "label": stain.name,
            "color": stain.color,
            "active": True,
            "window": {"min": 0, "max": 65535, "start": 100, "end": 100 + 2 * stain.amplitude},
        }
        for stain in STAINS
    ]
    return {
        "ome": {
            "version": "0.5",
            "multiscales": [
                {"name": "cycif", "axes": axes, "datasets": datasets, "type": "mean 2x2 in-plane"}
            ],
            "omero": {"channels": channels},
        },
        SAMPLE: _about(settings),
    }


def _write_zarr(
    path: Path,
    tissue: Tissue,
    shape: tuple[int, int, int],
    tile_size: tuple[int, int, int],
    attributes: dict[str, Any],
    seed: int,
) -> None:
    """Compress the voxels in memory, then write the files.

    zarr would write files from threads of its own, which continue after an exception in this one.
    """
    files: dict[str, Buffer] = {}
    group = zarr.open_group(MemoryStore(files), mode="w", zarr_format=3, attributes=attributes)
    shapes = _level_shapes(shape)
    arrays = [
        group.create_array(
            str(level),
            shape=(len(STAINS), *size),
            chunks=tuple(min(a, b) for a, b in zip(_CHUNK, (1, *size), strict=True)),
            dtype="uint16",
            # With one thread and no dictionary, the bytes are the same every time.
            compressors=ZstdCodec(level=3),
            dimension_names=("c", "z", "y", "x"),
        )
        for level, size in enumerate(shapes)
    ]
    _, height, width = tile_size
    for y in range(0, shape[1], height):
        for stain in range(len(STAINS)):
            # A whole row of tiles is written at a time, so that few chunks are written twice.
            row = np.concatenate(
                [
                    microscope.record(tissue, stain, box=box, seed=seed)
                    for x in range(0, shape[2], width)
                    for box in [Box((0, y, x), (shape[0], y + height, x + width))]
                ],
                axis=2,
            )
            arrays[0][stain, :, y : y + height, :] = row
    for finer, coarser in pairwise(arrays):
        _halve(finer, coarser)
    for key, content in files.items():
        (path / key).parent.mkdir(parents=True, exist_ok=True)
        (path / key).write_bytes(content.to_bytes())


def _halve(finer: zarr.Array[Any], coarser: zarr.Array[Any]) -> None:
    """Fill a level with the means of 2 x 2 voxels of the finer level, rounded half up."""
    channels, depth, height, width = coarser.shape
    for c, y, x in product(range(channels), range(0, height, 128), range(0, width, 512)):
        rows, columns = min(128, height - y), min(512, width - x)
        block = np.asarray(finer[c, :, 2 * y : 2 * (y + rows), 2 * x : 2 * (x + columns)])
        sums = block.reshape(depth, rows, 2, columns, 2).sum(axis=(2, 4), dtype=np.uint32)
        coarser[c, :, y : y + rows, x : x + columns] = ((sums + 2) // 4).astype(np.uint16)


def _truth(tissue: Tissue, shape: tuple[int, int, int], settings: dict[str, Any]) -> dict[str, Any]:
    """Return the ground truth of the voxels; lengths in um, positions (z, y, x)."""
    waves = [
        microscope.waves_of(index, tissue.size_um, settings["seed"]) for index in range(len(STAINS))
    ]
    centers = np.array([nucleus.center_um for nucleus in tissue.nuclei]).reshape(-1, 3)
    z, y, x = centers.T
    levels = microscope.background(STAINS[0], waves[0], (z, y, x))
    return {
        "sample": _about(settings),
        "note": "positions are (z, y, x) in um; the centre of voxel (0, 0, 0) is the origin. "
        "A dye's boundary lies where the voxels hold background + amplitude * brightness / 2.",
        "shape": list(shape),
        "spacing_um": list(SPACING_UM),
        "blur_sigma_um": list(BLUR_UM),
        "noise": {
            "offset": microscope.OFFSET,
            "counts_per_electron": microscope.GAIN,
            "read_sigma": microscope.READ_NOISE,
        },
        "channels": [
            {
                "name": stain.name,
                "amplitude": stain.amplitude,
                "background": {
                    "offset": microscope.OFFSET,
                    "mean": stain.background,
                    "waves": [
                        {"k_per_um": list(wave.k), "phase": wave.phase, "weight": wave.weight}
                        for wave in waves[index]
                    ],
                },
            }
            for index, stain in enumerate(STAINS)
        ],
        "nuclei": [
            {
                "center_um": list(nucleus.center_um),
                "semi_axes_um": list(nucleus.semi_axes_um),
                "rotation": nucleus.rotation.tolist(),
                "brightness": nucleus.brightness,
                "boundary_intensity": float(level + STAINS[0].amplitude * nucleus.brightness / 2),
            }
            for nucleus, level in zip(tissue.nuclei, levels, strict=True)
        ],
        "membrane_um": microscope.MEMBRANE_UM,
        "cytoplasm": microscope.CYTOPLASM,
        "cells": [
            {
                "center_um": list(cell.center_um),
                "radius_um": cell.cell_um,
                "brightness": cell.brightness,
            }
            for cell in tissue.nuclei
            if cell.cell_um > 0.0
        ],
        "vessel_wall_um": microscope.WALL_UM,
        "vessels": [
            {
                "start_um": list(tube.start_um),
                "end_um": list(tube.end_um),
                "radius_um": tube.radius_um,
            }
            for tube in tissue.vessels
        ],
    }
