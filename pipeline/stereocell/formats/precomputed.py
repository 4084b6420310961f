"""Write Neuroglancer's precomputed format: image chunks by scale, and meshes of several levels.

A mesh file holds each level as one fragment, in a cell twice as large as that of the finer level.
That is the octree of the format with one node for each level. Draco's numbers are vertices on a
grid of 16 bits in the cell.

References: Neuroglancer, src/datasource/precomputed/{volume,meshes,segment_properties}.md
"""

import json
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

CHUNK = 64  # voxels, edge of a chunk
QUANTIZATION_BITS = 16
_MAX_STEP = (1 << QUANTIZATION_BITS) - 1
Encode = Callable[..., bytes]


@dataclass(frozen=True, slots=True)
class Level:
    """A mesh at one level of detail: positions float64 (n, 3), nm; triangles uint32 (m, 3)."""

    positions: NDArray[np.float64]
    triangles: NDArray[np.uint32]

    @property
    def edge_nm(self) -> float:
        """The approximate length of a triangle's edge, which is the level's smallest detail."""
        a, b, c = self.positions[self.triangles].transpose(1, 0, 2)
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
        return float(np.sqrt(2 * area / max(len(self.triangles), 1)))


def write_info(folder: Path, content: dict[str, Any]) -> None:
    """Create a folder and write its `info`."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "info").write_text(json.dumps(content, indent=1), encoding="utf-8", newline="\n")


def write_volume(
    folder: Path, scales: Sequence[tuple[NDArray[Any], tuple[float, float, float]]]
) -> None:
    """Write an image as chunks of voxels, at one or more resolution levels.

    scales  finest first: voxels (channel, z, y, x), and the voxel spacing (x, y, z) in nm
    """
    described = []
    for number, (values, resolution) in enumerate(scales):
        _write_chunks(folder / str(number), values)
        described.append(
            {
                "key": str(number),
                "size": list(values.shape[:0:-1]),
                "resolution": list(resolution),
                "voxel_offset": [0, 0, 0],
                "chunk_sizes": [[CHUNK] * 3],
                "encoding": "raw",
            }
        )
    finest = scales[0][0]
    write_info(
        folder,
        {
            "@type": "neuroglancer_multiscale_volume",
            "type": "image",
            "data_type": finest.dtype.name,
            "num_channels": len(finest),
            "scales": described,
        },
    )


def _write_chunks(folder: Path, values: NDArray[Any]) -> None:
    folder.mkdir(parents=True)
    size = values.shape[:0:-1]
    for z, y, x in product(*(range(0, n, CHUNK) for n in size[::-1])):
        ends = [min(a + CHUNK, n) for a, n in zip((x, y, z), size, strict=True)]
        name = "_".join(f"{a}-{b}" for a, b in zip((x, y, z), ends, strict=True))
        part = values[:, z : ends[2], y : ends[1], x : ends[0]]
        (folder / name).write_bytes(np.ascontiguousarray(part).tobytes())  # x is the fastest


def write_meshes_info(folder: Path, names: dict[int, str]) -> None:
    """Write the description of the meshes of a folder, and their names by segment."""
    write_info(
        folder,
        {
            "@type": "neuroglancer_multilod_draco",
            "vertex_quantization_bits": QUANTIZATION_BITS,
            "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0],
            "lod_scale_multiplier": 1,
            "segment_properties": "segment_properties",
        },
    )
    labels = {"id": "label", "type": "label", "values": list(names.values())}
    inline = {"ids": [str(segment) for segment in names], "properties": [labels]}
    write_info(
        folder / "segment_properties",
        {"@type": "neuroglancer_segment_properties", "inline": inline},
    )


def write_mesh(folder: Path, segment: int, levels: Sequence[Level], encode: Encode) -> None:
    """Write a mesh of one or more levels, finest first. encode: DracoPy's function."""
    places = np.concatenate([level.positions for level in levels])
    origin = np.floor(places.min(axis=0)).astype("<f4")
    shape = np.ceil(places.max(axis=0) - origin + 1).astype("<f4")
    fragments, scales = [], [0.0]
    for number, level in enumerate(levels):
        cell = shape.astype(np.float64) * 2**number
        steps = np.rint((level.positions - origin) / cell * _MAX_STEP)
        fragments.append(
            encode(
                steps.astype(np.float32),
                level.triangles,
                quantization_bits=QUANTIZATION_BITS,
                quantization_range=_MAX_STEP,
                quantization_origin=[0.0, 0.0, 0.0],
            )
        )
        scales.append(max(level.edge_nm, 1.01 * scales[-1]))
    count = len(levels)
    manifest = [
        shape.tobytes(),
        origin.tobytes(),
        struct.pack("<I", count),
        np.array(scales[1:], "<f4").tobytes(),
        np.zeros((count, 3), "<f4").tobytes(),  # offsets of vertices
        np.ones(count, "<u4").tobytes(),  # number of fragments of each level
    ]
    for fragment in fragments:
        # Position of the fragment, and its size in bytes
        manifest.append(struct.pack("<4I", 0, 0, 0, len(fragment)))
    (folder / f"{segment}.index").write_bytes(b"".join(manifest))
    (folder / str(segment)).write_bytes(b"".join(fragments))
