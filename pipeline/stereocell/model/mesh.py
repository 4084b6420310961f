"""Triangle meshes in world space."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Mesh:
    """An indexed triangle mesh, counter-clockwise seen from outside.

    positions  float32 (n, 3)  x, y, z in um, world space
    triangles  uint32  (m, 3)  vertex numbers
    normals    float32 (n, 3)  unit length, pointing out
    uvs        float32 (n, 2)  origin at the lower left, v upwards (USD's convention), or None
    tangents   float32 (n, 4)  xyz and the bitangent's sign (glTF's convention), or None
    colors     float32 (n, 3)  linear RGB, 0..1, read from a stage; None: the channel's colour
    openness   float32 (n,)    1 - ambient occlusion, 0..1, read from a stage, or None
    objects    int32   (n,)    object of each vertex, counted in its tile from 0 (object_table.py),
                               or None. The vertices of an object are contiguous and not shared
    paint      float32 (n,)    intensity of the painted channel on objects, 0..1, or None
    """

    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    normals: NDArray[np.float32]
    uvs: NDArray[np.float32] | None = None
    tangents: NDArray[np.float32] | None = None
    colors: NDArray[np.float32] | None = None
    openness: NDArray[np.float32] | None = None
    objects: NDArray[np.int32] | None = None
    paint: NDArray[np.float32] | None = None


@dataclass(frozen=True, slots=True)
class Spread:
    """Distances in um from one surface to another; see `meshes.distance.measure_spread`."""

    mean: float
    p95: float
    p99: float
    max: float


@dataclass(frozen=True, slots=True)
class Quality:
    """How a level of detail was made, and how accurate it is.

    away, back  distances from the iso-surface to this mesh, and from this mesh to the iso-surface
    samples     number of points on each surface at which the distances were measured
    mended      components that were simplified again, because the first attempt had defects
    fallbacks   components that kept the surface of the next finer level of detail, because all
                attempts had defects
    faults      defects that are left by the exact check (see `find_defects`)
    angle_deg   1st percentile of the triangles' smallest angles, degrees
    enclosed    share of the iso-surface's area that lies inside this mesh or on it, 0..1
    """

    away: Spread
    back: Spread
    samples: int
    mended: int
    fallbacks: int
    faults: int
    angle_deg: float
    enclosed: float


@dataclass(frozen=True, slots=True)
class Baked:
    """Values baked from the fine surface: (h, w) texels if the level has UVs, or (n,) vertices.

    openness  uint8, 255 without ambient occlusion
    paint     uint8, intensity of the painted channel; None: none is painted
    texel_um  edge of a texel on the surface, um; 0: there are no maps
    charts    number of UV charts
    reason    why there are no maps; empty: there are maps
    """

    openness: NDArray[np.uint8]
    paint: NDArray[np.uint8] | None = None
    texel_um: float = 0.0
    charts: int = 0
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Lod:
    """One level of detail. `lod0` is the finest.

    distance_um  99th percentile of the distances between this mesh and the iso-surface, at points
                 on both (see `measure_spread`)
    normal_map   uint8 (h, w, 3), tangent space, row 0 at the top (v = 1), or None
    quality      None: not known
    baked        ambient occlusion and painted channel; None: neither
    farthest_um  largest of these distances, if there is no `quality`; None: not known
    """

    mesh: Mesh
    distance_um: float
    normal_map: NDArray[np.uint8] | None = None
    quality: Quality | None = None
    baked: Baked | None = None
    farthest_um: float | None = None

    @property
    def largest_um(self) -> float:
        """The largest measured distance between this mesh and the iso-surface, um."""
        if self.quality is None:
            return self.distance_um if self.farthest_um is None else self.farthest_um
        return max(self.distance_um, self.quality.away.max, self.quality.back.max)
