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
    colors     float32 (n, 3)  linear RGB 0..1, what a stage draws it in, or None: its look's colour
    openness   float32 (n,)    0..1, what a stage says of ambient occlusion (1: none of it), or None
    """

    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    normals: NDArray[np.float32]
    uvs: NDArray[np.float32] | None = None
    tangents: NDArray[np.float32] | None = None
    colors: NDArray[np.float32] | None = None
    openness: NDArray[np.float32] | None = None


@dataclass(frozen=True, slots=True)
class Spread:
    """Distances in um from one surface to another: see `distance.measure_spread`."""

    mean: float
    p95: float
    max: float


@dataclass(frozen=True, slots=True)
class Quality:
    """What is known of a level of detail beside its distance.

    away, back  distances from the iso-surface to this mesh, and from this mesh to it
    mended      bodies that had to be simplified again, as the first attempt had faults
    fallbacks   bodies that kept the level before's surface, as every attempt had faults
    faults      left over, by the exact check: see `find_defects`
    angle_deg   1st percentile of the triangles' smallest angles
    enclosed    share of the iso-surface's area that lies inside this mesh or on it
    """

    away: Spread
    back: Spread
    mended: int
    fallbacks: int
    faults: int
    angle_deg: float
    enclosed: float


@dataclass(frozen=True, slots=True)
class Baked:
    """What the fine surface told a level: at texels (h, w) if it has UVs, else at vertices (n,).

    openness  uint8; 255: no ambient occlusion
    paint     uint8; another channel's intensity, or None
    texel_um  edge of a texel on the surface; 0: no maps
    charts    of its UVs
    reason    why there are no maps; empty if there are
    """

    openness: NDArray[np.uint8]
    paint: NDArray[np.uint8] | None = None
    texel_um: float = 0.0
    charts: int = 0
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Lod:
    """One level of detail. `lod0` is the finest.

    distance_um  measured distance between this mesh and the iso-surface: see `distance`
    normal_map   uint8 (h, w, 3), tangent space, row 0 at the top (v = 1), or None
    quality      how it was made and how true it is; None where the writer doesn't know
    baked        ambient occlusion and paint; None: neither
    """

    mesh: Mesh
    distance_um: float
    normal_map: NDArray[np.uint8] | None = None
    quality: Quality | None = None
    baked: Baked | None = None
