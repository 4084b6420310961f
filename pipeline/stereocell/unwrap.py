"""UVs for a coarse level of detail, and the fine surface's normals baked into a map for it.

Charts and packing are xatlas's. The map is in tangent space, as UsdPreviewSurface and glTF expect,
and stores where the fine surface's normal lies relative to the coarse mesh's interpolated frame.
"""

import atexit
import ctypes
from collections import deque
from dataclasses import dataclass, replace

import numpy as np
import xatlas
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from stereocell.errors import UsageError
from stereocell.mesh import Mesh
from stereocell.options import setting

# xatlas 0.0.11 tells its worker threads to end without holding the lock that they sleep under: an
# atlas destroyed at the very moment when a worker lies down waits for it for ever (seen once, its
# stack in ~TaskScheduler). So an atlas is destroyed some unwraps later, its workers long asleep,
# and the last ones never: the process takes them along.
ATLASES_KEPT = 4
_past_atlases: deque[xatlas.Atlas] = deque()

NEIGHBOURS = 6  # fine vertices that a texel looks at
TEXTURES = tuple(2**k for k in range(6, 14))  # edges that a map may have


@dataclass(frozen=True, slots=True)
class UnwrapOptions:
    """Baked maps."""

    coarse_lods: int = setting(2, "how many of the coarsest LODs get UVs and a baked normal map")
    # Texels of one coarse voxel spacing want an edge of 1750 on a unit of 194 x 512 x 512 that is
    # full of membranes, 300 to 1000 on nuclei and vessels. A map of 1024 took 2.6 s and 0.3 GB to
    # bake and 1.1 MB in the bundle; 2048 took 17 s, 1.4 GB and 3.6 MB, too much for a coarse level.
    max_texture: int = setting(1024, "texels, largest edge of a square normal map")

    def __post_init__(self) -> None:
        if self.coarse_lods < 0:
            raise UsageError(f"unwrap.coarse_lods is {self.coarse_lods}, expected 0 or more")
        if self.max_texture not in TEXTURES:
            raise UsageError(
                f"unwrap.max_texture is {self.max_texture}, expected a power of two "
                f"from {TEXTURES[0]} to {TEXTURES[-1]}"
            )


def unwrap(mesh: Mesh, max_texture: int, texel_um: float) -> tuple[Mesh, int]:
    """Return the mesh with UVs and tangents, split along chart seams, and its map's edge in texels.

    The edge is the power of two at which a texel spans about `texel_um`, up to `max_texture`.
    """
    atlas = xatlas.Atlas()
    atlas.add_mesh(mesh.positions, mesh.triangles, mesh.normals)
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = float(np.linalg.norm(doubled, axis=1).sum()) / 2
    # charts fill about two thirds of the square
    wanted = np.sqrt(1.5 * area) / texel_um
    size = min(max_texture, max(TEXTURES[0], int(2 ** np.ceil(np.log2(max(wanted, 1))))))
    charts, pack = xatlas.ChartOptions(), xatlas.PackOptions()
    charts.max_iterations = 1
    pack.resolution, pack.padding = size, 2
    atlas.generate(charts, pack)
    vertices, triangles, uvs = atlas.get_mesh(0)
    _retire(atlas)
    # a full atlas page can come out larger than asked for; xatlas scales UVs by that page
    split = Mesh(
        mesh.positions[vertices],
        triangles.astype(np.uint32),
        mesh.normals[vertices],
        uvs.astype(np.float32),
    )
    return replace(split, tangents=make_tangents(split)), size


def _retire(atlas: xatlas.Atlas) -> None:
    _past_atlases.append(atlas)
    if len(_past_atlases) > ATLASES_KEPT:
        _past_atlases.popleft()


@atexit.register
def _never_destroy_the_last() -> None:
    for atlas in _past_atlases:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(atlas))


def make_tangents(mesh: Mesh) -> NDArray[np.float32]:
    """Return per-vertex tangents (n, 4): along +u, orthogonal to the normal, w the handedness."""
    assert mesh.uvs is not None
    p, t = mesh.positions.astype(np.float64), mesh.uvs.astype(np.float64)
    a, b, c = mesh.triangles.T
    e1, e2, d1, d2 = p[b] - p[a], p[c] - p[a], t[b] - t[a], t[c] - t[a]
    signed = d1[:, 0] * d2[:, 1] - d2[:, 0] * d1[:, 1]  # twice the area in UV space
    side = np.where(signed < 0, -1.0, 1.0)[:, None]
    along_u = (e1 * d2[:, 1:] - e2 * d1[:, 1:]) * side  # weighted by area: not divided
    along_v = (e2 * d1[:, :1] - e1 * d2[:, :1]) * side
    sum_u, sum_v = np.zeros_like(p), np.zeros_like(p)
    for corner in (a, b, c):
        np.add.at(sum_u, corner, along_u)
        np.add.at(sum_v, corner, along_v)
    n = mesh.normals.astype(np.float64)
    tangent = sum_u - n * (n * sum_u).sum(axis=1, keepdims=True)
    length = np.linalg.norm(tangent, axis=1, keepdims=True)
    # a vertex whose triangles have no area in UV space: any direction across the normal serves
    spare = np.cross(n, np.where(np.abs(n[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    spare /= np.maximum(np.linalg.norm(spare, axis=1, keepdims=True), 1e-20)
    tangent = np.where(length > 1e-12, tangent / np.maximum(length, 1e-12), spare)
    handed = np.where((np.cross(n, tangent) * sum_v).sum(axis=1) < 0, -1.0, 1.0)
    return np.concatenate([tangent, handed[:, None]], axis=1).astype(np.float32)


def bake_normals(coarse: Mesh, fine: Mesh, size: int) -> NDArray[np.uint8]:
    """Return the tangent-space normal map (size, size, 3), row 0 at v = 1, of the fine surface.

    Each texel's place on the coarse mesh takes the normals of the nearest fine vertices, weighted
    by inverse distance, of those on the same side: the other wall of a thin shell may be nearer.
    Texels outside the charts repeat the nearest inside, so that mip levels stay clean.
    """
    assert coarse.uvs is not None
    assert coarse.tangents is not None
    triangle, weights, texel = _rasterise(coarse.uvs, coarse.triangles, size)
    corners = coarse.triangles[triangle]

    def interpolate(values: NDArray[np.float32]) -> NDArray[np.float64]:
        return np.einsum("nk,nkd->nd", weights, values[corners].astype(np.float64))

    tree = cKDTree(fine.positions, balanced_tree=False, compact_nodes=False)
    # a list of k asks for k columns, even for one
    neighbours = list(range(1, min(NEIGHBOURS, tree.n) + 1))
    distance, nearest = tree.query(interpolate(coarse.positions), k=neighbours)
    normal = _unit(interpolate(coarse.normals))
    candidates = fine.normals[nearest].astype(np.float64)
    weight = 1.0 / np.maximum(distance, 1e-6)
    weight *= np.einsum("nkd,nd->nk", candidates, normal) > 0
    wanted = np.einsum("nk,nkd->nd", weight, candidates)
    wanted = np.where(weight.sum(axis=1, keepdims=True) > 0, _unit(wanted), normal)
    tangent = _unit(interpolate(coarse.tangents[:, :3]))
    handed = coarse.tangents[corners[:, 0], 3:]
    bitangent = np.cross(normal, tangent) * handed
    frame = np.stack([(wanted * axis).sum(axis=1) for axis in (tangent, bitangent, normal)], axis=1)
    frame[:, 2] = np.maximum(frame[:, 2], 0.05)  # a map can't bend a normal below its surface

    row, column = np.divmod(texel, size)
    image = np.zeros((size, size, 3))
    image[..., 2] = 1.0
    image[row, column] = _unit(frame)
    covered = np.zeros((size, size), bool)
    covered[row, column] = True
    if covered.any():
        rows, columns = ndimage.distance_transform_edt(
            ~covered, return_distances=False, return_indices=True
        )
        image = image[rows, columns]
    return np.round((image + 1) * 127.5).astype(np.uint8)


def _rasterise(
    uvs: NDArray[np.float32], triangles: NDArray[np.uint32], size: int
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Return, for each texel under a triangle: the triangle, barycentric weights, texel number."""
    # texel centres in pixels, row 0 at v = 1
    corners = uvs[triangles].astype(np.float64) * size
    corners[..., 1] = size - corners[..., 1]
    low = np.clip(np.floor(corners.min(axis=1) - 0.5), 0, size - 1).astype(np.int64)
    high = np.clip(np.ceil(corners.max(axis=1) - 0.5), 0, size - 1).astype(np.int64)
    extent = high - low + 1
    count = extent.prod(axis=1)
    triangle = np.repeat(np.arange(len(triangles)), count)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    column = low[triangle, 0] + within % extent[triangle, 0]
    row = low[triangle, 1] + within // extent[triangle, 0]
    a, b, c = (corners[triangle, k] for k in range(3))
    p = np.stack([column + 0.5, row + 0.5], axis=1)
    whole = _cross(b - a, c - a)
    flat = whole == 0
    whole = np.where(flat, 1.0, whole)
    wb, wc = _cross(p - a, c - a) / whole, _cross(b - a, p - a) / whole
    weights = np.stack([1 - wb - wc, wb, wc], axis=1)
    inside = (weights.min(axis=1) >= -1e-9) & ~flat
    return triangle[inside], weights[inside], (row * size + column)[inside]


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-20)
