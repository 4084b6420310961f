"""Write a mesh as binary STL, which printers' programs and mesh editors read.

STL knows no unit. Numbers are um, as everywhere: a slicer takes them for mm, 1000 times the size.
"""

import struct
from pathlib import Path

import numpy as np

from stereocell.model.errors import StageError
from stereocell.model.mesh import Mesh
from stereocell.model.version import GENERATOR
from stereocell.storage.atomic_write import replacing

_HEAD = 84  # bytes: a line of text, the number of triangles
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write_stl(path: Path, mesh: Mesh) -> None:
    """Write the triangles (x, y, z in um) in place of an older file. Raises OutputError."""
    triangles = np.zeros(len(mesh.triangles), _TRIANGLE)
    corners = mesh.positions[mesh.triangles]
    a, b, c = corners.astype(np.float64).transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    triangles["normal"] = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    triangles["corners"] = corners
    head = f"{GENERATOR}, um".encode().ljust(_HEAD - 4)
    with replacing(path) as file:
        file.write_bytes(head + np.uint32(len(triangles)).tobytes() + triangles.tobytes())


def check_stl(path: Path) -> None:
    """Raise StageError if a file is missing, or isn't as long as its number of triangles says."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as error:
        raise StageError(f"{path}: can't be read: {error.strerror or error}") from error
    if len(head) < _HEAD:
        raise StageError(f"{path}: can't be read as STL: its header was cut short")
    (count,) = struct.unpack_from("<I", head, _HEAD - 4)
    expected = _HEAD + _TRIANGLE.itemsize * count
    if size != expected:
        raise StageError(
            f"{path}: can't be read as STL: {size} bytes, expected {expected} for {count} triangles"
        )
