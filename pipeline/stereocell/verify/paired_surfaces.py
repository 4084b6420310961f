"""Pair the vertices and triangles of a bundle's surface with those of the stage.

The bundle orders triangles and vertices for the GPU (formats/meshopt.py). The same order is made
again from the stage's triangles. If the bundle's triangles are in this order, their vertices are
known, too, and only distances are left to be compared. Otherwise, as after an update of the
package that orders them, pairs are found by distance, which takes three times as long.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from stereocell.formats.meshopt import reorder

# Odd factors that turn a triangle's vertices into one number of 64 bits
_FACTORS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)


@dataclass(frozen=True, slots=True)
class Surface:
    """A triangle mesh.

    places     float64 (n, 3), vertices, m
    triangles  (m, 3), vertices of each triangle
    objects    int32 (n,), object of each vertex, by which the bundle groups triangles; None: the
               surface has no objects, or is the bundle's
    """

    places: NDArray[np.float64]
    triangles: NDArray[Any]
    objects: NDArray[np.int32] | None = None


@dataclass(frozen=True, slots=True)
class Pairs:
    """Vertices and triangles of the stage, each with its twin in the bundle.

    apart           m, largest distance of a vertex, or of a triangle's centre, from its twin. The
                    twin is the nearest one, or one that lies nearer than allowed.
    vertices        (k,), numbers of vertices in the stage
    twins           (k,), numbers of their twins in the bundle
    triangles       (m, 3), vertices of the stage's triangles
    twin_triangles  (m, 3), vertices of their twins, of which another one may be the first
    """

    apart: float
    vertices: NDArray[np.int64]
    twins: NDArray[np.int64]
    triangles: NDArray[np.int64]
    twin_triangles: NDArray[np.int64]


def pair_surfaces(stage: Surface, bundle: Surface, limit_m: float) -> Pairs:
    """Return the pairs of two surfaces with the same number of triangles.

    limit_m  largest distance that is allowed between twins
    """
    return _pair_by_order(stage, bundle, limit_m) or _pair_by_distance(stage, bundle)


def _pair_by_order(stage: Surface, bundle: Surface, limit_m: float) -> Pairs | None:
    """Return the pairs, or None if they have another order or are too far apart."""
    indices, order = reorder(stage.triangles, objects=stage.objects)
    expected = indices.reshape(-1, 3).astype(np.int64)
    if len(order) != len(bundle.places) or not _are_turned(expected, bundle.triangles):
        return None
    apart = float(np.sqrt(((stage.places[order] - bundle.places) ** 2).sum(axis=1).max()))
    triangles = order[bundle.triangles]
    # This comparison does not rely on the package that orders the triangles.
    if apart > limit_m or not np.array_equal(_marks(triangles), _marks(stage.triangles)):
        return None
    return Pairs(apart, order, np.arange(len(order)), triangles, bundle.triangles)


def _are_turned(expected: NDArray[np.int64], found: NDArray[np.int64]) -> bool:
    """Return whether rows (m, 3) are the same, whichever of their numbers comes first."""
    turned = (np.roll(expected, k, axis=1) for k in range(3))
    return bool(np.any([(one == found).all(axis=1) for one in turned], axis=0).all())


def _marks(triangles: NDArray[Any]) -> NDArray[np.uint64]:
    """Return a number for each triangle, sorted. It depends on vertices and facing."""
    first = np.argmin(triangles, axis=1)[:, None]
    turned = np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)
    return np.sort((turned.astype(np.uint64) * _FACTORS).sum(axis=1))


def _pair_by_distance(stage: Surface, bundle: Surface) -> Pairs:
    used = np.unique(stage.triangles).astype(np.int64)  # the bundle leaves the others out
    far, twins = _nearest(stage.places[used], bundle.places)
    there, here = (one.places[one.triangles].mean(axis=1) for one in (stage, bundle))
    far_triangles, twin_triangles = _nearest(there, here)
    return Pairs(
        max(far, far_triangles),
        used,
        twins,
        stage.triangles.astype(np.int64),
        bundle.triangles[twin_triangles],
    )


def _nearest(
    ours: NDArray[np.float64], theirs: NDArray[np.float64]
) -> tuple[float, NDArray[np.int64]]:
    """Return the largest distance to the nearest point of the other set, and the nearest points.

    ours, theirs  (n, 3), (k, 3), m; the distance counts in both directions
    result        distance, m; for each of our points the number (n,) of the nearest of theirs
    """
    there, nearest = cKDTree(theirs).query(ours)
    back, _ = cKDTree(ours).query(theirs)
    return float(max(np.max(there), np.max(back))), np.asarray(nearest, np.int64)
