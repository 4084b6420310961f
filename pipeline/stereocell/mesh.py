"""Triangle meshes in world space."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Mesh:
    """An indexed triangle mesh, counter-clockwise seen from outside.

    positions  float32 (n, 3)  x, y, z in um, world
    triangles  uint32  (m, 3)
    normals    float32 (n, 3)  unit length, pointing out
    uvs        float32 (n, 2)  origin at the lower left, v upwards (USD's convention), or None
    tangents   float32 (n, 4)  xyz and the bitangent's sign (glTF's convention), or None
    """

    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    normals: NDArray[np.float32]
    uvs: NDArray[np.float32] | None = None
    tangents: NDArray[np.float32] | None = None


@dataclass(frozen=True, slots=True)
class Lod:
    """One level of detail. `lod0` is the finest.

    distance_um  measured distance between this mesh and the iso-surface: see `lod`
    normal_map   uint8 (h, w, 3), tangent space, row 0 at the top (v = 1), or None
    """

    mesh: Mesh
    distance_um: float
    normal_map: NDArray[np.uint8] | None = None
