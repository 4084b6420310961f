"""The brain's hull: a closed mesh that grows from inside until it meets dark voxels, as in BET.

Every vertex moves out along its normal while the voxels below it are bright for their surroundings.
Smoothness holds it back, by a rule that distinguishes a gyrus from a sharp corner. The threshold is
local, so a bias field matters little. The mesh is smooth, so it bridges sulci and does not enter
the neck, which is too narrow for it.

References
S. M. Smith, "Fast robust automated brain extraction", Human Brain Mapping 17, 2002.
doi:10.1002/hbm.10062
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import ConvexHull

Points = NDArray[np.float64]  # (n, 3), (z, y, x), mm
Triangles = NDArray[np.int64]
# 642 vertices, 14 mm apart on an adult's brain; the second mesh has four times as many
SUBDIVISIONS = 3
ITERATIONS = 400  # steps with each of the two meshes
SMOOTH_MM = (3.33, 10.0)  # mm; smaller radii of curvature are smoothed away, larger ones are kept
# mm below a vertex: reach of the search for dark voxels and for bright ones, and its step
DEEP_MM, NEAR_MM, EVERY_MM = 20.0, 10.0, 2.0
EDGE = 0.55  # Smith's fractional threshold between dark and bright, 0..1


@dataclass(frozen=True, slots=True)
class Hull:
    """A closed mesh whose triangles face outward.

    points     float64 (n, 3), (z, y, x), mm from the centre of voxel (0, 0, 0)
    triangles  int64 (m, 3)
    """

    points: Points
    triangles: Triangles


def find_hull(
    field: NDArray[np.float32],
    spacing_mm: tuple[float, float, float],
    *,
    center_mm: tuple[float, float, float],
    radius_mm: float,
    levels: tuple[float, float, float],
) -> Hull:
    """Return the hull of the brain around `center_mm`.

    field       float32 (z, y, x), voxels of about 2 mm, because finer ones show the floors of sulci
    spacing_mm  (z, y, x)
    center_mm   (z, y, x), from the centre of voxel (0, 0, 0)
    radius_mm   radius of a ball with the brain's volume; the mesh starts with half of it
    levels      voxel values: dark (air, bone), the least bright value, the brain's median
    """
    unit, triangles = _icosphere(SUBDIVISIONS)
    points = np.asarray(center_mm) + 0.5 * radius_mm * unit
    points = _inflate(points, triangles, field, np.asarray(spacing_mm), levels)
    points, triangles = _quarter(points, triangles)
    points = _inflate(points, triangles, field, np.asarray(spacing_mm), levels)
    return Hull(points, triangles)


def _inflate(
    points: Points,
    triangles: Triangles,
    field: NDArray[np.float32],
    spacing: Points,
    levels: tuple[float, float, float],
) -> Points:
    neighbours, counts = _neighbours(triangles, len(points))
    is_one = (np.arange(neighbours.shape[1]) < counts[:, None])[..., None]
    dark, least, middle = levels
    depths = np.arange(1.0, DEEP_MM, EVERY_MM)
    near = int((depths < NEAR_MM).sum())
    edge_of = triangles[:, 0], triangles[:, 1]
    padded = np.pad(field, 1).astype(np.float32)  # voxels beyond the ends count as 0
    sharp, blunt = (1 / r for r in SMOOTH_MM)
    for _ in range(ITERATIONS):
        normals = _normals(points, triangles)
        pull = (points[neighbours] * is_one).sum(axis=1) / counts[:, None] - points
        along = (pull * normals).sum(axis=1)
        tangent = pull - along[:, None] * normals
        edge = float(np.linalg.norm(points[edge_of[0]] - points[edge_of[1]], axis=1).mean())
        curvature = 2 * np.abs(along) / edge**2
        smooth = 0.5 * (1 + np.tanh(6 / (sharp - blunt) * (curvature - 0.5 * (sharp + blunt))))
        seen = _look_below(padded, points / spacing, normals / spacing, depths)
        low = np.maximum(dark, np.minimum(middle, seen.min(axis=1)))
        high = np.minimum(middle, np.maximum(least, seen[:, :near].max(axis=1)))
        level = dark + EDGE * (high - dark)
        outward = 2 * (low - level) / np.maximum(high - dark, 1e-6)
        step = 0.05 * edge * outward + smooth * along
        points = points + 0.5 * tangent + step[:, None] * normals
    return points


def fill_hull(
    hull: Hull,
    shape: tuple[int, int, int],
    *,
    spacing_mm: tuple[float, float, float],
    shift_mm: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> NDArray[np.bool_]:
    """Return the voxels that the hull encloses or crosses, bool (z, y, x).

    shape       shape (z, y, x) of the result, voxels
    spacing_mm  voxel spacing (z, y, x)
    shift_mm    (z, y, x), added to the hull's points
    """
    corners = (hull.points[hull.triangles] + np.asarray(shift_mm)) / np.asarray(spacing_mm)
    longest = float(np.abs(corners - np.roll(corners, 1, axis=1)).max())
    n = max(1, int(np.ceil(2 * longest)))
    a, b = (k.ravel() / n for k in np.mgrid[: n + 1, : n + 1])
    keep = a + b <= 1
    weights = np.stack([1 - a - b, a, b], axis=1)[keep]
    shell = np.zeros(tuple(s + 2 for s in shape), np.bool_)  # air on all sides
    for part in np.array_split(corners, 64):
        index = np.rint(np.einsum("wk,tkd->twd", weights, part)).astype(np.int64).reshape(-1, 3)
        index = np.clip(index, -1, shape) + 1
        shell[tuple(index.T)] = True
    filled = np.asarray(ndimage.binary_fill_holes(shell), np.bool_)
    return filled[1:-1, 1:-1, 1:-1]


def _look_below(
    padded: NDArray[np.float32], points: Points, normals: Points, depths: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return the voxels nearest to points moved down their normals by each depth, float32 (n, k).

    padded   the field with one voxel of air around it, which stands for all voxels beyond
    points   (n, 3), in voxels
    normals  (n, 3), in voxels
    depths   (k,)
    """
    flat = np.zeros((len(points), len(depths)), np.int64)
    for axis, n in enumerate(padded.shape):
        along = points[:, axis, None] - normals[:, axis, None] * depths
        index = np.rint(along).astype(np.int64)
        flat = flat * n + np.clip(index + 1, 0, n - 1)
    return padded.ravel()[flat]


def _normals(points: Points, triangles: Triangles) -> Points:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    sums = np.stack(
        [np.bincount(triangles.T.ravel(), np.tile(faces[:, k], 3), len(points)) for k in range(3)],
        axis=1,
    )
    return sums / np.maximum(np.linalg.norm(sums, axis=1), 1e-12)[:, None]


def _icosphere(subdivisions: int) -> tuple[Points, Triangles]:
    """Return a unit sphere (n, 3), (m, 3): an icosahedron whose triangles are quartered."""
    golden = (1 + 5**0.5) / 2
    corners = [(0.0, a, b * golden) for a in (-1, 1) for b in (-1, 1)]
    found = np.array([np.roll(corner, k) for corner in corners for k in range(3)])
    triangles = ConvexHull(found).simplices.astype(np.int64)
    points = found / np.linalg.norm(found, axis=1)[:, None]
    for _ in range(subdivisions):
        points, triangles = _quarter(points, triangles)
        points /= np.linalg.norm(points, axis=1)[:, None]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return points, triangles


def _quarter(points: Points, triangles: Triangles) -> tuple[Points, Triangles]:
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    unique, inverse = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    ab, bc, ca = (inverse.reshape(-1, 3) + len(points)).T
    a, b, c = triangles.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    quartered = np.concatenate([np.stack(part, axis=1) for part in parts])
    return np.concatenate([points, points[unique].mean(axis=1)]), quartered


def _neighbours(triangles: Triangles, n: int) -> tuple[Triangles, NDArray[np.int64]]:
    """Return the neighbours of each vertex (n, most), padded with 0, and their number (n,)."""
    edges = np.unique(
        np.concatenate([triangles[:, [a, b]] for a in range(3) for b in range(3) if a != b]), axis=0
    )
    counts = np.bincount(edges[:, 0], minlength=n)
    place = np.arange(len(edges)) - np.repeat(np.cumsum(counts) - counts, counts)
    table = np.zeros((n, int(counts.max())), np.int64)
    table[edges[:, 0], place] = edges[:, 1]
    return table, counts
