"""Write a mesh as binary STL, for slicers of 3D printers and mesh editors.

STL has no unit, and slicers read its numbers as mm. Closed tiles are in um, like everything else,
so they are 1000 times as large in print. `stereocell export` writes the unit that the head states.
"""

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.body import Body
from stereocell.model.errors import StageError
from stereocell.model.mesh import Mesh
from stereocell.model.version import GENERATOR
from stereocell.storage.atomic_write import replacing

_HEAD = 84  # bytes of the header: a line of text, the number of triangles
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write_stl(path: Path, mesh: Mesh) -> None:
    """Write the mesh, and replace an older file.

    mesh  positions float32 (n, 3) in um (x, y, z), triangles uint32 (m, 3)

    Raises OutputError if the file cannot be written.
    """
    with replacing(path) as file:
        _write(file, [(mesh.positions, mesh.triangles)], "um")


def write_stl_file(path: Path, bodies: Sequence[Body], *, unit: str) -> None:
    """Write bodies one after another. STL does not separate them, and has no colours."""
    _write(path, [(body.positions, body.triangles) for body in bodies], unit)


def _write(
    path: Path, meshes: Sequence[tuple[NDArray[np.float32], NDArray[np.uint32]]], unit: str
) -> None:
    head = f"{GENERATOR}, {unit}".encode().ljust(_HEAD - 4)
    count = sum(len(triangles) for _, triangles in meshes)
    with path.open("wb") as file:
        file.write(head + np.uint32(count).tobytes())
        for positions, corner_numbers in meshes:
            triangles = np.zeros(len(corner_numbers), _TRIANGLE)
            corners = positions[corner_numbers]
            a, b, c = corners.astype(np.float64).transpose(1, 0, 2)
            normal = np.cross(b - a, c - a)
            lengths = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
            triangles["normal"] = normal / lengths
            triangles["corners"] = corners
            file.write(triangles.tobytes())


def check_stl(path: Path) -> None:
    """Raise StageError if a file is missing, or its length does not match its triangle count."""
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
