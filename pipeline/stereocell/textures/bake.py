"""What the fine surface tells a coarser level: its normals, how open it lies, what is on it.

A place on the level goes to the nearest point of the fine surface's triangles, whose corners'
values are interpolated there. The fine surface reaches past the tile's cut: a texel's centre does
too, by half a texel, and neighbours must shade the same on both sides.
"""

from dataclasses import dataclass

import igl
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from stereocell.model.mesh import Mesh
from stereocell.textures.rasterize import find_texels
from stereocell.textures.seam_padding import find_chart_edges, fit_seam_texels

NEIGHBOURS = 8  # fine vertices looked at where the nearest point is on another wall
REACH = 1.5  # texels beyond a chart's edge whose values are found, not copied: bilinear lookups'
LOWEST = 0.05  # of a map's normals along the mesh's: a map can't bend one below its surface


@dataclass(frozen=True, slots=True)
class FineSurface:
    """The finest surface, some voxels past the tile's cut, with values at its vertices.

    openness  float32 (n,) 0..1: see `occlusion`
    paint     float32 (n,) 0..1: another channel's intensity; None: nothing is painted
    """

    mesh: Mesh
    openness: NDArray[np.float32]
    paint: NDArray[np.float32] | None = None

    @classmethod
    def bare(cls, mesh: Mesh) -> "FineSurface":
        return cls(mesh, np.ones(len(mesh.positions), np.float32))


@dataclass(frozen=True, slots=True)
class Found:
    """What the fine surface says at n places: unit normals (n, 3), openness and paint (n,)."""

    normals: NDArray[np.float64]
    openness: NDArray[np.float64]
    paint: NDArray[np.float64] | None


@dataclass(frozen=True, slots=True)
class Maps:
    """Images of a level, row 0 at v = 1; texels between charts repeat the nearest inside.

    normals   uint8 (h, w, 3), tangent space
    openness  uint8 (h, w); 255: all of the sky is seen
    paint     uint8 (h, w) or None
    """

    normals: NDArray[np.uint8]
    openness: NDArray[np.uint8]
    paint: NDArray[np.uint8] | None


class Baker:
    """Looks up the fine surface; its search trees are built once."""

    def __init__(self, fine: FineSurface) -> None:
        self._fine = fine
        self._vertices = fine.mesh.positions.astype(np.float64)
        self._triangles = fine.mesh.triangles.astype(np.int64)
        self._tree = igl.AABB()
        self._tree.init(self._vertices, self._triangles)
        self._corners: cKDTree | None = None

    def look_up(self, points: NDArray[np.float64], normals: NDArray[np.float64]) -> Found:
        """Return what lies nearest to the points (n, 3) and faces as the normals (n, 3) do.

        The other wall of a thin shell may be nearer: then the vertices around are asked.
        """
        fine = self._fine
        _, nearest, place = self._tree.squared_distance(self._vertices, self._triangles, points)
        corners = self._triangles[nearest]
        weights = _barycentric(self._vertices[corners], np.asarray(place))

        def interpolate(values: NDArray[np.float32]) -> NDArray[np.float64]:
            return np.einsum("nk,nk...->n...", weights, values[corners].astype(np.float64))

        found = _unit(interpolate(fine.mesh.normals))
        openness = interpolate(fine.openness)
        paint = None if fine.paint is None else interpolate(fine.paint)
        turned = np.flatnonzero((found * normals).sum(axis=1) <= 0)
        if len(turned):
            near, share, hopeless = self._around(points[turned], normals[turned])
            mixed = _unit(np.einsum("nk,nkd->nd", share, fine.mesh.normals[near]))
            found[turned] = np.where(hopeless[:, None], normals[turned], mixed)
            openness[turned] = (share * fine.openness[near]).sum(axis=1)
            if paint is not None and fine.paint is not None:
                paint[turned] = (share * fine.paint[near]).sum(axis=1)
        return Found(found, openness, paint)

    def _around(
        self, points: NDArray[np.float64], normals: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_]]:
        """Return near vertices, their shares (by closeness, of those that face the same way), and
        whether none does."""
        if self._corners is None:
            self._corners = cKDTree(self._vertices, balanced_tree=False, compact_nodes=False)
        # a list of k asks for k columns, even for one
        columns = list(range(1, min(NEIGHBOURS, self._corners.n) + 1))
        distance, near = self._corners.query(points, k=columns)
        closeness: NDArray[np.float64] = 1 / np.maximum(distance, 1e-6)
        facing = np.einsum("nkd,nd->nk", self._fine.mesh.normals[near], normals) > 0
        hopeless = ~facing.any(axis=1)
        closeness *= facing | hopeless[:, None]
        return np.asarray(near), closeness / closeness.sum(axis=1, keepdims=True), hopeless


def bake(coarse: Mesh, size: tuple[int, int], baker: Baker) -> Maps:
    """Return the maps of a mesh with UVs and tangents, `size` (height, width) texels."""
    assert coarse.uvs is not None
    texel, triangle, weights, outside = find_texels(coarse.uvs, coarse.triangles, size, REACH)
    values = _compute_texels(coarse, triangle, weights, baker)
    image = fill(values, texel, size)
    inside = np.zeros(size[0] * size[1], bool)
    inside[texel[outside == 0]] = True
    triangle, weights = find_chart_edges(coarse.uvs, coarse.triangles, size)
    uvs = np.einsum(
        "nk,nkd->nd", weights, coarse.uvs[coarse.triangles[triangle]].astype(np.float64)
    )
    wanted = _compute_texels(coarse, triangle, weights, baker)
    image = fit_seam_texels(image, ~inside.reshape(size), uvs=uvs, wanted=wanted)
    bytes_ = np.round(np.clip(image, 0, 1) * 255).astype(np.uint8)
    return Maps(
        np.ascontiguousarray(bytes_[..., :3]),
        np.ascontiguousarray(bytes_[..., 3]),
        np.ascontiguousarray(bytes_[..., 4]) if bytes_.shape[2] > 4 else None,
    )


def _compute_texels(
    coarse: Mesh, triangle: NDArray[np.int64], weights: NDArray[np.float64], baker: Baker
) -> NDArray[np.float64]:
    """Return what maps hold at places of triangles: normal (3), openness and, if any, paint; 0..1.

    `weights` (n, 3): barycentric, and below 0 or above 1 for places outside the triangle.
    """
    assert coarse.tangents is not None
    corners = coarse.triangles[triangle]

    def interpolate(values: NDArray[np.float32]) -> NDArray[np.float64]:
        return np.einsum("nk,nkd->nd", weights, values[corners].astype(np.float64))

    normal = _unit(interpolate(coarse.normals))
    tangent = _unit(interpolate(coarse.tangents[:, :3]))
    handed = coarse.tangents[corners[:, 0], 3:]
    found = baker.look_up(interpolate(coarse.positions), normal)
    frame = _in_frame(found.normals, tangent, np.cross(normal, tangent) * handed, normal)
    frame[:, 2] = np.maximum(frame[:, 2], LOWEST)
    parts = [_unit(frame) / 2 + 0.5, found.openness[:, None]]
    if found.paint is not None:
        parts.append(found.paint[:, None])
    return np.concatenate(parts, axis=1)


def _in_frame(
    vectors: NDArray[np.float64],
    tangent: NDArray[np.float64],
    bitangent: NDArray[np.float64],
    normal: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the factors of the three axes that add up to the vectors: what a renderer undoes.

    Between vertices the axes are not at right angles any more; a renderer takes them as they are.
    """
    # Cramer's rule: the axes of the inverse are cross products
    rows = np.cross(bitangent, normal), np.cross(normal, tangent), np.cross(tangent, bitangent)
    whole = (tangent * rows[0]).sum(axis=1)  # below 0 where a chart is mirrored
    whole = np.copysign(np.maximum(np.abs(whole), 1e-3), whole)
    return np.stack([(vectors * row).sum(axis=1) / whole for row in rows], axis=1)


def fill(
    values: NDArray[np.float64], texel: NDArray[np.int64], size: tuple[int, int]
) -> NDArray[np.float64]:
    """Return an image (h, w, k) of the values (n, k) of texels; others repeat the nearest."""
    height, width = size
    image = np.zeros((height * width, values.shape[1]))
    image[texel] = values
    covered = np.zeros(height * width, bool)
    covered[texel] = True
    rows, columns = ndimage.distance_transform_edt(
        ~covered.reshape(size), return_distances=False, return_indices=True
    )
    return image.reshape(height, width, -1)[rows, columns]


def _barycentric(corners: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weights (n, 3) of points in their triangles (n, 3, 3), 0..1, of sum 1."""
    a, b, c = corners.transpose(1, 0, 2)
    parts = [np.cross(c - b, points - b), np.cross(a - c, points - c), np.cross(b - a, points - a)]
    facing = np.cross(b - a, c - a)
    weights = np.stack([(part * facing).sum(axis=1) for part in parts], axis=1)
    weights = np.maximum(weights, 0.0)
    total = weights.sum(axis=1, keepdims=True)
    return np.where(total > 0, weights / np.where(total > 0, total, 1.0), 1 / 3)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-20)
