"""Write a mesh as binary STL, which printers' programs and mesh editors read.

STL knows no unit. Numbers are um, as everywhere: a slicer takes them for mm, 1000 times the size.
"""

from pathlib import Path

import numpy as np

from stereocell.mesh import Mesh
from stereocell.write.atomic import replacing
from stereocell.write.generator import GENERATOR

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write_stl(path: Path, mesh: Mesh) -> None:
    """Write the triangles (x, y, z in um) in place of an older file. Raises OutputError."""
    triangles = np.zeros(len(mesh.triangles), _TRIANGLE)
    corners = mesh.positions[mesh.triangles]
    a, b, c = corners.astype(np.float64).transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    triangles["normal"] = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    triangles["corners"] = corners
    head = f"{GENERATOR}, um".encode().ljust(80)
    with replacing(path) as file:
        file.write_bytes(head + np.uint32(len(triangles)).tobytes() + triangles.tobytes())
