"""Bake the fine surface into a coarser level: normals, ambient occlusion, the sampled channel.

A point of the level takes the values of the nearest point on the fine surface's triangles,
interpolated between the triangle's corners. The fine surface reaches past the tile's cut, because
the centre of a texel can lie half a texel past it, and both neighbours must shade the cut alike.
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

NEIGHBOURS = 8  # number of fine vertices that are searched if the nearest point is on another wall
REACH = 1.5  # texels outside of a chart that get values of their own, for bilinear lookups
# Least cosine between a map's normal and the mesh's, so that no normal points inwards
LOWEST = 0.05


@dataclass(frozen=True, slots=True)
class FineSurface:
    """The finest surface, with some voxels past the tile's cut, and values at its vertices.

    openness  float32 (n,) 0..1: 1 - ambient occlusion, see textures/ambient_occlusion.py
    paint     float32 (n,) 0..1: intensity of the sampled channel; None: no channel is sampled
    """

    mesh: Mesh
    openness: NDArray[np.float32]
    paint: NDArray[np.float32] | None = None


@dataclass(frozen=True, slots=True)
class Found:
    """Values of the fine surface at n points.

    normals   float64 (n, 3), unit length
    openness  float64 (n,), 0..1: 1 - ambient occlusion
    paint     float64 (n,), 0..1: intensity of the sampled channel, or None
    """

    normals: NDArray[np.float64]
    openness: NDArray[np.float64]
    paint: NDArray[np.float64] | None


@dataclass(frozen=True, slots=True)
class Maps:
    """Maps of a level, row 0 at v = 1. Texels between charts repeat the nearest texel of a chart.

    normals   uint8 (h, w, 3), tangent space
    openness  uint8 (h, w); 255: no ambient occlusion
    paint     uint8 (h, w); None: no channel is sampled
    """

    normals: NDArray[np.uint8]
    openness: NDArray[np.uint8]
    paint: NDArray[np.uint8] | None


class Baker:
    """Looks up values of the fine surface. The search trees are built once."""

    def __init__(self, fine: FineSurface) -> None:
        self._fine = fine
        self._vertices = fine.mesh.positions.astype(np.float64)
        self._triangles = fine.mesh.triangles.astype(np.int64)
        self._tree = igl.AABB()
        self._tree.init(self._vertices, self._triangles)
        self._corners: cKDTree | None = None

    def look_up(self, points: NDArray[np.float64], normals: NDArray[np.float64]) -> Found:
        """Return the values at the nearest points of the fine surface that face the same way.

        points   float64 (n, 3), um, world space (x, y, z)
        normals  float64 (n, 3), unit length, of the coarse surface

        The other wall of a thin shell may be nearer. In that case, vertices nearby that face the
        same way are used instead.
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
        """Return near vertices, their weights, and whether none of them faces the same way.

        Near vertices have larger weights. Vertices that face away have weights of 0.
        """
        if self._corners is None:
            self._corners = cKDTree(self._vertices, balanced_tree=False, compact_nodes=False)
        # For a list of k numbers, the tree's query returns k columns, even for k = 1.
        columns = list(range(1, min(NEIGHBOURS, self._corners.n) + 1))
        distance, near = self._corners.query(points, k=columns)
        closeness: NDArray[np.float64] = 1 / np.maximum(distance, 1e-6)
        facing = np.einsum("nkd,nd->nk", self._fine.mesh.normals[near], normals) > 0
        hopeless = ~facing.any(axis=1)
        closeness *= facing | hopeless[:, None]
        return np.asarray(near), closeness / closeness.sum(axis=1, keepdims=True), hopeless


def bake(coarse: Mesh, size: tuple[int, int], baker: Baker) -> Maps:
    """Return the maps of a level of detail.

    coarse  a mesh with UVs and tangents
    size    (height, width), texels
    """
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
    """Return maps' values at points of triangles, 0..1: normal (3), openness, and paint if any.

    weights  (n, 3), barycentric; below 0 or above 1 for points outside the triangle
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
    """Return the factors (n, 3) by which the three axes add up to the vectors.

    A renderer multiplies by the same axes. Between vertices they are no longer at right angles, and
    a renderer uses them unchanged.
    """
    # Cramer's rule: the axes of the inverse are cross products.
    rows = np.cross(bitangent, normal), np.cross(normal, tangent), np.cross(tangent, bitangent)
    whole = (tangent * rows[0]).sum(axis=1)  # negative where a chart is mirrored
    whole = np.copysign(np.maximum(np.abs(whole), 1e-3), whole)
    return np.stack([(vectors * row).sum(axis=1) / whole for row in rows], axis=1)


def fill(
    values: NDArray[np.float64], texel: NDArray[np.int64], size: tuple[int, int]
) -> NDArray[np.float64]:
    """Return an image (h, w, k) with values at some texels; all others repeat the nearest of these.

    values  float64 (n, k)
    texel   int64 (n,), row * w + column
    size    (height, width), texels
    """
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
    """Return the weights (n, 3) of points (n, 3) in triangles (n, 3, 3), 0..1, with a sum of 1."""
    a, b, c = corners.transpose(1, 0, 2)
    parts = [np.cross(c - b, points - b), np.cross(a - c, points - c), np.cross(b - a, points - a)]
    facing = np.cross(b - a, c - a)
    weights = np.stack([(part * facing).sum(axis=1) for part in parts], axis=1)
    weights = np.maximum(weights, 0.0)
    total = weights.sum(axis=1, keepdims=True)
    return np.where(total > 0, weights / np.where(total > 0, total, 1.0), 1 / 3)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-20)
