"""Write bodies as one binary PLY mesh with a colour at each vertex."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from stereocell.formats.body import Body
from stereocell.model.version import GENERATOR

_VERTEX = np.dtype([("place", "<f4", 3), ("color", "u1", 3)])
_FACE = np.dtype([("count", "u1"), ("corners", "<u4", 3)])


def write_ply(path: Path, bodies: Sequence[Body], *, unit: str) -> None:
    """Write the bodies one after another; `unit` stands in a comment."""
    head = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment {GENERATOR}, unit {unit}",
        f"element vertex {sum(len(body.positions) for body in bodies)}",
        *(f"property float {axis}" for axis in "xyz"),
        *(f"property uchar {color}" for color in ("red", "green", "blue")),
        f"element face {sum(len(body.triangles) for body in bodies)}",
        "property list uchar uint vertex_indices",
        "end_header\n",
    ]
    with path.open("wb") as file:
        file.write("\n".join(head).encode("ascii"))
        for body in bodies:
            vertices = np.zeros(len(body.positions), _VERTEX)
            vertices["place"], vertices["color"] = body.positions, body.srgb
            file.write(vertices.tobytes())
        first = 0
        for body in bodies:
            faces = np.zeros(len(body.triangles), _FACE)
            faces["count"], faces["corners"] = 3, body.triangles + np.uint32(first)
            file.write(faces.tobytes())
            first += len(body.positions)
