"""Write a mesh as binary STL, for slicers of 3D printers and mesh editors.

STL has no unit. Numbers are um, as everywhere: a slicer reads them as mm, 1000 times the size.
"""

import struct
from pathlib import Path

import numpy as np

from stereocell.model.errors import StageError
from stereocell.model.mesh import Mesh
from stereocell.model.version import GENERATOR
from stereocell.storage.atomic_write import replacing

_HEAD = 84  # bytes of the header: a line of text, the number of triangles
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write_stl(path: Path, mesh: Mesh) -> None:
    """Write the mesh in place of an older file.

    mesh  positions float32 (n, 3) in um (x, y, z), triangles uint32 (m, 3)

    Raises OutputError if the file can't be written.
    """
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
    """Raise StageError if a file is missing, or its length doesn't fit its triangle count."""
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
