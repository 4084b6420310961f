"""Fit the texels around charts so that lookups on both sides of a seam, and of a cut, are right.

A bilinear lookup on the edge of a chart mixes texels inside with texels outside, whose centres lie
past the surface. The texels outside may have any value, since only these lookups read them. They
are fitted by a few rounds of averaged Kaczmarz projections, so that the mix is the surface's value.
"""

import numpy as np
from numpy.typing import NDArray

ROUNDS = 8  # number of rounds of projections
MAX_CHANGE = 0.35  # largest change of a texel, where values are 0..1
PER_TEXEL = 2.0  # points per texel of a chart's edge


def find_chart_edges(
    uvs: NDArray[np.float32], triangles: NDArray[np.uint32], size: tuple[int, int]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return points on the edges that have only one triangle.

    uvs        float32 (n, 2)
    triangles  uint32 (m, 3)
    size       (height, width), texels
    result     triangle int64 (k,), barycentric weights float64 (k, 3)
    """
    height, width = size
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    ends = np.sort(edges.astype(np.int64), axis=1)
    number = ends[:, 0] * len(uvs) + ends[:, 1]
    _, first, count = np.unique(number, return_index=True, return_counts=True)
    lone = np.sort(first[count == 1])
    across = (uvs[edges[lone, 1]] - uvs[edges[lone, 0]]).astype(np.float64) * (width, height)
    places = np.ceil(np.linalg.norm(across, axis=1) * PER_TEXEL).astype(np.int64) + 1
    row = np.repeat(np.arange(len(lone)), places)
    step = np.arange(len(row)) - np.repeat(np.cumsum(places) - places, places)
    share = step / np.maximum(places - 1, 1)[row]
    triangle, corner = np.divmod(lone[row], 3)
    weights = np.zeros((len(row), 3))
    here = np.arange(len(row))
    weights[here, corner] = 1 - share
    weights[here, (corner + 1) % 3] = share
    return triangle, weights


def fit_seam_texels(
    image: NDArray[np.float64],
    is_free: NDArray[np.bool_],
    *,
    uvs: NDArray[np.float64],
    wanted: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the image with its free texels fitted to lookups.

    image    float64 (h, w, k), 0..1, row 0 at v = 1
    is_free  bool (h, w), texels that may change, by MAX_CHANGE at most
    uvs      float64 (n, 2), positions of bilinear lookups
    wanted   float64 (n, k), 0..1, desired results of these lookups
    """
    height, width, depth = image.shape
    x, y = uvs[:, 0] * width - 0.5, (1 - uvs[:, 1]) * height - 0.5
    left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    texels, weights = [], []
    for right in (0, 1):
        for below in (0, 1):
            column = np.clip(left + right, 0, width - 1)
            texels.append(np.clip(top + below, 0, height - 1) * width + column)
            part = (x - left) if right else (1 - x + left)
            weights.append(part * ((y - top) if below else (1 - y + top)))
    texel, weight = np.stack(texels, axis=1), np.stack(weights, axis=1)
    loose = weight * is_free.ravel()[texel]
    squared = (loose**2).sum(axis=1)
    step = np.divide(loose, squared[:, None], out=np.zeros_like(loose), where=loose > 0.05)
    used, texel = np.unique(texel, return_inverse=True)
    texel = texel.reshape(weight.shape)
    start = image.reshape(-1, depth)[used]
    fitted = start.copy()
    total = np.maximum(np.bincount(texel.ravel(), loose.ravel(), len(fitted)), 1e-9)
    for _ in range(ROUNDS):
        off = wanted - np.einsum("nj,njk->nk", weight, fitted[texel])
        for k in range(depth):
            change = (off[:, k, None] * step * loose).ravel()
            fitted[:, k] += np.bincount(texel.ravel(), change, len(fitted)) / total
        lowest, highest = np.maximum(start - MAX_CHANGE, 0), np.minimum(start + MAX_CHANGE, 1)
        fitted = np.clip(fitted, lowest, highest)
    whole = image.reshape(-1, depth).copy()
    whole[used] = fitted
    return whole.reshape(image.shape)
