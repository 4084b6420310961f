"""Write one volume of a bundle: a 3D texture with mip levels, and the ranges of its bricks."""

import hashlib
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.bundle.tile_part import FileRef, write_file
from stereocell.bundle.write_transfer2d import PlacedVolume, count_tile
from stereocell.filters.min_max_bricks import min_max_bricks, mip_levels
from stereocell.formats.ktx2 import encode_3d
from stereocell.storage.file_list import measure
from stereocell.usd.composed_appearance import ComposedAppearance


def write_volume(
    root: Path,
    tile_id: str,
    appearance: ComposedAppearance,
    volume: PlacedVolume,
    voxels: NDArray[np.uint8],
    counted: NDArray[np.uint8] | None = None,
) -> tuple[dict[str, Any], list[FileRef], bytes]:
    """Write one volume; return its entry in volumes.json, its files and its joint histogram.

    voxels   uint8 (z, y, x), with the apron, after the window
    counted  voxels of the same shape for the histogram; None: `voxels`

    The histogram is compressed, as `count_tile` returns it. Raises OutputError if a file can't be
    written.
    """
    counted = voxels if counted is None else counted
    texture = encode_3d(mip_levels(voxels))
    bricks = encode_3d([min_max_bricks(voxels)])
    path = f"volumes/{tile_id}/{appearance.id}"
    files = [
        write_file(root, f"{path}.ktx2", texture.data),
        write_file(root, f"{path}_bricks.ktx2", bricks.data),
    ]
    entry = {
        "tile": tile_id,
        "file": asdict(files[0]),
        "bricks": asdict(files[1]),
        "size": list(volume.size),
        "apron": volume.apron,
        "bounds_um": {"min": list(volume.low), "max": list(volume.high)},
        # Rows of a matrix for row vectors are columns of the same matrix for column vectors.
        "matrix": [float(n) for n in volume.matrix.ravel()],
        **({} if volume.measured is None else {"measured": measure(volume.measured)}),
        "levels": [
            {
                "size": list(level.size),
                "offset": level.offset,
                "length": level.length,
                "sha256": hashlib.sha256(
                    texture.data[level.offset : level.offset + level.length]
                ).hexdigest(),
            }
            for level in texture.levels
        ],
    }
    return entry, files, count_tile(counted, volume, appearance.transfer_2d.gradient_max)
