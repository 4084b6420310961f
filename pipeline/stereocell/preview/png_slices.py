"""Write one channel as 8-bit PNG slices, with a JSON that describes them.

    000.png 001.png ...     slice z, from posterior to anterior for DICOM and NIfTI
    slices.json             size, spacing, window, orientation, modality: schemas/slices.schema.json

The window is found as in a build, so that 0 and 255 mean the same here as there.
"""

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from stereocell.building.channel_survey import statistics_task
from stereocell.building.open_source import open_source, source_of
from stereocell.building.plan import Plan
from stereocell.building.settings import Settings
from stereocell.building.tasks.window import measure_statistics
from stereocell.isosurface.options import SurfaceOptions
from stereocell.model.errors import OutputError, UsageError
from stereocell.model.rigid_transform import IDENTITY
from stereocell.model.version import GENERATOR
from stereocell.model.volume import Volume
from stereocell.storage.atomic_write import replacing_folder

INDEX = "slices.json"
FORMAT, VERSION = "stereocell-slices", 1
# directions of growing index, for a source with a known place in a body
ANATOMICAL = {"slices": "anterior", "rows": "inferior", "columns": "left"}
UNKNOWN = {"slices": "towards the viewer", "rows": "down", "columns": "right"}


def without_surface(settings: Settings) -> Settings:
    """Return settings with all surface lengths 0, so that they suit all voxels."""
    lengths = {f.name: 0.0 for f in fields(SurfaceOptions) if f.name.endswith("_um")}
    return replace(settings, surface=SurfaceOptions(**lengths))  # type: ignore[arg-type]


def write_slices(plan: Plan, folder: Path) -> int:
    """Write the plan's region of its one channel; return the number of slices.

    folder  replaced as a whole if it holds slices

    Raises UsageError for more than one channel, OutputError for a folder with other content,
    SourceError where the source can't be read.
    """
    if len(plan.channels) != 1:
        found = ", ".join(channel.name for channel in plan.channels)
        raise UsageError(f"slices are of one channel: found {found}, expected --channels with one")
    if folder.exists() and not (folder / INDEX).is_file() and _holds(folder):
        raise OutputError(f"{folder}: exists and holds no slices: no {INDEX} in it")
    dataset, channel = open_source(source_of(plan)), plan.channels[0]
    volume = dataset.read(channel.index, plan.region, plan.level)
    window = measure_statistics(statistics_task(plan, channel)).window
    with replacing_folder(folder) as new:
        names = [f"{z:0{len(str(len(volume.voxels)))}d}.png" for z in range(len(volume.voxels))]
        for name, plane in zip(names, volume.voxels, strict=True):
            Image.fromarray(to_bytes(plane, window)).save(new / name)
        content = _describe(plan, volume, window, names)
        (new / INDEX).write_text(json.dumps(content, indent=1) + "\n")
    return len(names)


def to_bytes(plane: NDArray[Any], window: tuple[float, float]) -> NDArray[np.uint8]:
    """Return grey values as uint8 of the same shape: the window becomes 0..255, the rest is cut."""
    low, high = window
    share = (plane.astype(np.float32) - np.float32(low)) / np.float32(high - low)
    return np.rint(255 * np.clip(share, 0, 1)).astype(np.uint8)


def _describe(
    plan: Plan, volume: Volume, window: tuple[float, float], names: list[str]
) -> dict[str, object]:
    is_placed = plan.placement != IDENTITY
    return {
        "format": FORMAT,
        "version": VERSION,
        "generator": GENERATOR,
        "modality": plan.modality,
        "shape": list(volume.voxels.shape),
        "spacing_um": list(volume.spacing_um),
        "origin_um": list(volume.origin_um),
        "window": list(window),
        "axes_grow_to": ANATOMICAL if is_placed else UNKNOWN,
        "placement": [list(row) for row in plan.placement],
        "slices": names,
    }


def _holds(folder: Path) -> bool:
    return not folder.is_dir() or any(folder.iterdir())
