"""Compare a tile's volumes in a bundle with the stage's: voxels of all mip levels, and bricks."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.bundle.manifest import REMEDY
from stereocell.filters.min_max_bricks import min_max_bricks, mip_levels
from stereocell.storage.json_files import read_json
from stereocell.usd.read_volume import ComposedVolume
from stereocell.verify.bundle_files import read_texels


def placement_of(volume: ComposedVolume) -> dict[str, Any]:
    """Return the volume's place in the form of the bundle's volumes.json."""
    return {
        "size": list(volume.size),
        "apron": volume.apron,
        "bounds_um": {"min": list(volume.low), "max": list(volume.high)},
        "matrix": [float(number) for number in volume.matrix.ravel()],
    }


def find_volume(bundle: Path, channel: dict[str, Any], tile_id: str) -> dict[str, Any] | None:
    """Return the entry of a tile in a channel's volumes.json; None if it has none."""
    content = read_json(bundle / channel["volumes"]["path"], "volumes.schema.json", REMEDY)
    return next((one for one in content["volumes"] if one["tile"] == tile_id), None)


def compare_volume(bundle: Path, entry: dict[str, Any], voxels: NDArray[np.uint8]) -> Iterator[str]:
    """Yield differences of a volume's mip levels and bricks from `voxels`, uint8 (z, y, x)."""
    file = bundle / entry["file"]["path"]
    found, expected = read_texels(file), mip_levels(voxels)
    if [level.shape[:3] for level in found] != [level.shape for level in expected]:
        yield f"{file.name}: its resolution levels have other sizes than those of the stage"
        return
    for k, (level, wanted) in enumerate(zip(found, expected, strict=True)):
        wrong = int((level[..., 0] != wanted).sum())
        if wrong:
            yield (
                f"{file.name}: resolution level {k}: {wrong} of {wanted.size} voxels differ from "
                "the stage"
            )
    file = bundle / entry["bricks"]["path"]
    (bricks,), ends = read_texels(file), min_max_bricks(voxels)
    if bricks.shape != ends.shape or (bricks != ends).any():
        yield f"{file.name}: the least and largest values of bricks differ from the stage"
