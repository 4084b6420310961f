"""Rasterize triangles: texels of a map, pixels of a view."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.depth_buffer import find_visible, weigh_pixels

_AT_ONCE = 1 << 20  # texels or pixels that are computed together, in about 0.2 GB


def find_texels(
    uvs: NDArray[np.float32],
    triangles: NDArray[np.uint32],
    size: tuple[int, int],
    beyond: float,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the texels of a map that lie in or near a mesh's triangles.

    uvs        float32 (n, 2), origin at the lower left
    triangles  uint32 (m, 3)
    size       (height, width), texels; row 0 at v = 1
    beyond     texels; a texel outside of all triangles takes the nearest edge within this distance
    result     texel int64 (k,), row * width + column; triangle int64 (k,); barycentric weights
               float64 (k, 3); distance to the triangles float64 (k,), in texels, 0 inside

    A texel's position is its centre. Weights are not clamped: they give the position in the
    triangle's plane.
    """
    height, width = size
    corners = uvs[triangles].astype(np.float64) * (width, height)
    corners[..., 1] = height - corners[..., 1]
    nearest = np.full(height * width, np.inf)
    triangle_of = np.zeros(height * width, np.int64)
    weights_of = np.zeros((height * width, 3))
    for triangle, weights, texel, outside in _cover(corners, size, beyond):
        better = np.flatnonzero(outside < nearest[texel])
        # The nearest triangle of a texel comes last, since the last assignment to a texel remains.
        order = better[np.argsort(-outside[better], kind="stable")]
        at = texel[order]
        nearest[at] = outside[order]
        triangle_of[at], weights_of[at] = triangle[order], weights[order]
    found = np.flatnonzero(np.isfinite(nearest))
    return found, triangle_of[found], weights_of[found], nearest[found]


@dataclass(frozen=True, slots=True)
class Seen:
    """The nearest surface at each pixel of an image, over several meshes.

    nearest   float64 (height, width), depth; larger is nearer; minus infinity: nothing is visible
    mesh      int32 (height, width), number of the mesh; -1: nothing is visible
    triangle  int32 (height, width), index of the triangle of that mesh; undefined where nothing is
              visible
    """

    nearest: NDArray[np.float64]
    mesh: NDArray[np.int32]
    triangle: NDArray[np.int32]

    @classmethod
    def nothing(cls, size: tuple[int, int]) -> "Seen":
        """Return an image (height, width) without a surface."""
        nearest, mesh = np.full(size, -np.inf), np.full(size, -1, np.int32)
        return cls(nearest, mesh, np.empty(size, np.int32))

    def add(
        self,
        number: int,
        places: NDArray[np.float64],
        depth: NDArray[np.float64],
        triangles: NDArray[np.uint32],
    ) -> None:
        """Add a mesh, which hides what lies behind it.

        places     float64 (n, 2), vertices in pixels, x right, y down
        depth      float64 (n,), larger is nearer
        triangles  uint32 (m, 3)
        """
        find_visible(
            np.ascontiguousarray(places),
            np.ascontiguousarray(depth),
            np.ascontiguousarray(triangles, np.uint32),
            number,
            self.nearest,
            self.mesh,
            self.triangle,
        )

    def of(
        self, number: int, places: NDArray[np.float64], triangles: NDArray[np.uint32]
    ) -> tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.float64]]:
        """Return the visible points of a mesh.

        places, triangles  as they were added
        result  pixel int64 (k,), row * width + column; triangle int32 (k,); barycentric weights
                float64 (k, 3)
        """
        pixel, width = np.flatnonzero(self.mesh == number), self.mesh.shape[1]
        drawn = np.ascontiguousarray(triangles, np.uint32)
        weights = weigh_pixels(pixel, width, self.triangle, drawn, np.ascontiguousarray(places))
        return pixel, self.triangle.ravel()[pixel], weights


def _cover(
    corners: NDArray[np.float64], size: tuple[int, int], beyond: float
) -> Iterator[
    tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]
]:
    """Yield triangle, weights, pixel and distance (0: inside) of each pixel near triangles.

    corners  (m, 3, 2) in pixels, x right, y down
    """
    _, width = size
    low, high = _boxes(corners, size, beyond)
    extent = np.maximum(high - low + 1, 0)
    frames, is_flat = _frames(corners)
    count = np.where(is_flat, 0, extent.prod(axis=1))  # flat triangles cover no pixel
    ends = np.cumsum(count)
    first = 0
    while first < len(corners):
        done = ends[first - 1] if first else 0
        stop = max(int(np.searchsorted(ends, done + _AT_ONCE, side="right")), first + 1)
        part = slice(first, stop)
        triangle = np.repeat(np.arange(first, stop), count[part])
        within = np.arange(len(triangle)) - np.repeat(ends[part] - count[part] - done, count[part])
        across = np.repeat(extent[part, 0], count[part])
        column = np.repeat(low[part, 0], count[part]) + within % across
        row = np.repeat(low[part, 1], count[part]) + within // across
        own = np.repeat(frames[:, part], count[part], axis=1)
        weights, outside = _weigh(own, column + 0.5, row + 0.5)
        near = outside <= beyond + 1e-9
        yield triangle[near], weights[near], (row * width + column)[near], outside[near]
        first = stop


def _boxes(
    corners: NDArray[np.float64], size: tuple[int, int], beyond: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first and last pixel (x, y) near each triangle: (m, 2)."""
    height, width = size
    last = np.array([width - 1, height - 1])
    a, b, c = corners.transpose(1, 0, 2)  # numpy is slow along an axis of length 3
    least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    low = np.clip(np.ceil(least - 0.5 - beyond - 1e-6), 0, last + 1)
    high = np.clip(np.floor(most - 0.5 + beyond + 1e-6), -1, last)
    return low.astype(np.int64), high.astype(np.int64)


def _frames(
    corners: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the numbers that `_weigh` needs for each triangle (10, m), and which are flat (m,).

    The numbers are corner a, edges a to b and a to c, twice the area, and the height over each
    edge.
    """
    a, b, c = corners.transpose(1, 2, 0)
    ab, ac = b - a, c - a
    twice = ab[0] * ac[1] - ab[1] * ac[0]
    sides = np.stack([np.hypot(*edge) for edge in (c - b, ac, ab)])
    # Slivers count as flat, because their weights are noise.
    is_flat = np.abs(twice) <= 1e-6 * sides.max(axis=0) ** 2 + 1e-12
    heights = np.abs(twice) / np.maximum(sides, 1e-12)
    return np.concatenate([a, ab, ac, twice[None], heights]), is_flat


def _weigh(
    frames: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return barycentric weights (n, 3), and each point's distance beyond its triangle's edges.

    For a point beyond a corner, that is less than its distance from the corner.

    frames  (10, n), numbers of each point's triangle, from `_frames`
    """
    ax, ay, abx, aby, acx, acy, twice, *heights = frames
    x, y = x - ax, y - ay
    weights = np.empty((len(x), 3))
    wa, wb, wc = weights.T
    wb[:] = (x * acy - y * acx) / twice
    wc[:] = (abx * y - aby * x) / twice
    wa[:] = 1 - wb - wc
    outside = np.zeros(len(x))
    for weight, height in zip((wa, wb, wc), heights, strict=True):
        np.maximum(outside, -weight * height, out=outside)
    return weights, outside
