"""Write channels of 8 bits as OME-Zarr 0.5 (Zarr v3) with one level.

Reference: https://ngff.openmicroscopy.org/0.5/
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.abc.buffer import Buffer
from zarr.codecs import ZstdCodec
from zarr.storage import MemoryStore

Triple = tuple[float, float, float]
CHUNK = (1, 64, 128, 128)  # voxels (c, z, y, x): 1 MB


def write_probabilities(
    path: Path,
    volumes: Sequence[NDArray[np.uint8]],
    *,
    channels: Sequence[tuple[str, Triple]],
    start: tuple[int, int, int],
    shape: tuple[int, int, int],
    spacing_um: Triple,
    origin_um: Triple,
) -> None:
    """Write the channels to a folder `path`.

    volumes     uint8 (z, y, x), one for each channel
    channels    name and linear RGB (0..1) of each
    start       voxel (z, y, x) at which the volumes begin
    shape       voxels (z, y, x) of the whole, which is 0 outside of the volumes and takes no space
    spacing_um  (z, y, x)
    origin_um   centre of voxel (0, 0, 0), (z, y, x)

    The same arguments give the same bytes. The write is not atomic, so the caller moves the folder.
    """
    axes: list[dict[str, str]] = [{"name": "c", "type": "channel"}]
    axes += [{"name": axis, "type": "space", "unit": "micrometer"} for axis in "zyx"]
    place = [
        {"type": "scale", "scale": [1.0, *spacing_um]},
        {"type": "translation", "translation": [0.0, *origin_um]},
    ]
    window = {"min": 0, "max": 255, "start": 0, "end": 255}
    shown = [
        {"label": name, "color": _hex(color), "active": True, "window": window}
        for name, color in channels
    ]
    attributes: dict[str, Any] = {
        "ome": {
            "version": "0.5",
            "multiscales": [
                {
                    "name": "tissue",
                    "axes": axes,
                    "datasets": [{"path": "0", "coordinateTransformations": place}],
                }
            ],
            "omero": {"channels": shown},
        }
    }
    files: dict[str, Buffer] = {}
    # The files are made in memory, because zarr writes from its own threads, which would outlive an
    # exception.
    group = zarr.open_group(MemoryStore(files), mode="w", zarr_format=3, attributes=attributes)
    array = group.create_array(
        "0",
        shape=(len(volumes), *shape),
        chunks=tuple(min(a, b) for a, b in zip(CHUNK, (1, *shape), strict=True)),
        dtype="uint8",
        fill_value=0,
        compressors=ZstdCodec(level=3),
        dimension_names=("c", "z", "y", "x"),
    )
    for k, volume in enumerate(volumes):
        z, y, x = (slice(a, a + n) for a, n in zip(start, volume.shape, strict=True))
        array[k, z, y, x] = volume
    for key, content in files.items():
        file = path / key
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content.to_bytes())


def _hex(linear: Triple) -> str:
    """Return the colour as RRGGBB in sRGB (IEC 61966-2-1)."""
    bent = (12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055 for v in linear)
    return "".join(f"{round(255 * v):02X}" for v in bent)
