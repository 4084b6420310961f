"""Compare a coarser level of detail, drawn with its baked maps, with the finest level by SSIM.

The pictures are drawn without OpenGL, so that the figures are equal on every machine. They have a
parallel projection, one light beside the viewer's eye, and ambient light that occlusion dims. Each
pixel is shaded by the normal map in the frame of the interpolated tangents, as in renderers of glTF
and USD. A level without maps is shaded by its interpolated normals.

The size of a picture is chosen so that the level's distance from the iso-surface, the 99th
percentile (`stereocell:distance`), spans ERROR_PX pixels, within bounds. A viewer at rest switches
to the next finer level where the largest distance (`stereocell:largestDistance`, `geometricError`
of tilesets) spans as many pixels.

SSIM is computed by scikit-image, and averaged over the picture.

References: Wang, Bovik, Sheikh & Simoncelli, "Image quality assessment: from error visibility to
structural similarity", IEEE Transactions on Image Processing 13(4), 2004,
https://doi.org/10.1109/TIP.2003.819861
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stereocell.model.mesh import Lod
from stereocell.textures.rasterize import Seen

# Directions (x, y, z) to the viewer: front, right, left, above, below. z points out of the front.
VIEWS = ((0.0, 0.0, 1.0), (0.9, 0.3, 0.5), (-0.9, 0.3, 0.5), (0.1, 0.9, 0.4), (0.1, -0.9, 0.4))
ERROR_PX = 2.0  # pixels, the web viewer's largest allowed error
MIN_PX, MAX_PX = 48, 256  # pixels, bounds of a picture's edge
CLOSE_PX = 512  # pixels, edge of the close picture, the same for all levels
_FINE = 2  # factor by which a picture is drawn larger before it is averaged down
_AMBIENT, _GROUND = 0.35, 0.0  # grey values 0..1 of ambient light and of the background


def find_likeness(fine: Lod, coarse: Lod) -> tuple[float, ...]:
    """Return the SSIM, -1..1, of two levels of one surface, one for each of VIEWS."""
    ends = np.array([fine.mesh.positions.min(axis=0), fine.mesh.positions.max(axis=0)])
    diagonal = float(np.linalg.norm(ends[1] - ends[0]))
    wanted = ERROR_PX * diagonal / max(coarse.distance_um, 1e-9)
    size = int(np.clip(wanted, MIN_PX, MAX_PX))
    return tuple(
        compare(draw(fine, view, ends=ends, size=size), draw(coarse, view, ends=ends, size=size))
        for view in VIEWS
    )


def find_close_likeness(fine: Lod, coarse: Lod) -> float:
    """Return the SSIM, -1..1, of two levels of one surface from the front, at CLOSE_PX."""
    ends = np.array([fine.mesh.positions.min(axis=0), fine.mesh.positions.max(axis=0)])
    pictures = (draw(lod, VIEWS[0], ends=ends, size=CLOSE_PX) for lod in (fine, coarse))
    return compare(*pictures)


def draw(
    lod: Lod, view: Sequence[float], *, ends: NDArray[np.float32], size: int
) -> NDArray[np.float64]:
    """Return the level as seen from `view`: float64 (size, size), grey 0..1.

    view  direction (x, y, z) towards the viewer
    ends  (2, 3): corners (x, y, z), um, of the box that fills the picture
    size  pixels along an edge
    """
    mesh = lod.mesh
    to_eye = np.asarray(view) / np.linalg.norm(view)
    right = np.cross([0.0, 1.0, 0.0], to_eye)
    right /= np.linalg.norm(right)
    up = np.cross(to_eye, right)
    edge = size * _FINE
    scale = edge / max(float(np.linalg.norm(ends[1] - ends[0])), 1e-12)
    from_middle = mesh.positions.astype(np.float64) - ends.mean(axis=0)
    places = np.stack([from_middle @ right, -(from_middle @ up)], axis=1) * scale + edge / 2
    depth = from_middle @ to_eye
    seen = Seen.nothing((edge, edge))
    seen.add(0, places, depth, mesh.triangles)
    pixel, triangle, weights = seen.of(0, places, mesh.triangles)
    normals, openness = _shading(lod, triangle, weights)
    normals *= np.where(normals @ to_eye < 0, -1.0, 1.0)[:, None]  # both sides are drawn
    light = to_eye + 0.5 * right + 0.5 * up
    light /= np.linalg.norm(light)
    picture = np.full(edge * edge, _GROUND)
    lit = np.maximum(normals @ light, 0)
    picture[pixel] = _AMBIENT * openness + (1 - _AMBIENT) * lit
    return picture.reshape(size, _FINE, size, _FINE).mean(axis=(1, 3))


def _shading(
    lod: Lod, triangle: NDArray[np.int32], weights: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return unit normals (n, 3) and openness (n,), 0..1, at points of triangles.

    triangle  (n,), index of each point's triangle
    weights   (n, 3), barycentric coordinates
    """
    mesh, baked = lod.mesh, lod.baked
    corners = mesh.triangles[triangle]

    def interpolate(values: NDArray[np.float32]) -> NDArray[np.float64]:
        return np.einsum("nk,nk...->n...", weights, values[corners].astype(np.float64))

    normals = _unit(interpolate(mesh.normals))
    openness = np.ones(len(triangle))
    if lod.normal_map is None or mesh.uvs is None or mesh.tangents is None:
        if baked is not None:
            openness = interpolate(baked.openness.astype(np.float32)) / 255
        return normals, openness
    uvs = interpolate(mesh.uvs)
    tangent = _unit(interpolate(mesh.tangents[:, :3]))
    bitangent = np.cross(normals, tangent) * mesh.tangents[corners[:, 0], 3:]
    x, y, z = (sample(lod.normal_map[..., k], uvs) / 127.5 - 1 for k in range(3))
    shaded = x[:, None] * tangent + y[:, None] * bitangent + z[:, None] * normals
    if baked is not None:
        openness = sample(baked.openness, uvs) / 255
    return _unit(shaded), openness


def sample(image: NDArray[np.uint8], uvs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values (n,) of an image uint8 (h, w) at UVs (n, 2), bilinear and clamped.

    Row 0 of the image lies at v = 1.
    """
    from scipy import ndimage  # slow to import, and few reports compare textures

    height, width = image.shape
    place = [(1 - uvs[:, 1]) * height - 0.5, uvs[:, 0] * width - 0.5]
    found: NDArray[np.float64] = ndimage.map_coordinates(
        image.astype(np.float64), place, order=1, mode="nearest"
    )
    return found


def compare(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Return the mean SSIM of two pictures of values 0..1, each float64 (height, width)."""
    from skimage.metrics import structural_similarity  # slow to import

    # The paper has a Gaussian window of 11 x 11 pixels and variances of the population.
    return float(
        structural_similarity(
            a, b, data_range=1.0, gaussian_weights=True, sigma=1.5, use_sample_covariance=False
        )
    )


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-20)
