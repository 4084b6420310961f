"""Measure for `cells.py` how true and sound the closed surfaces of cells are, and their overlap.

The truth of some cells is known by formula. For a mask without such a truth, the faces between its
voxels are used. Then even a good surface, which is smoother than the steps of voxels, differs by a
share of a voxel, so only the comparison of two surfaces is informative.
"""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.meshes.distance import Nearest
from stereocell.model.mesh import Mesh
from stereocell.model.volume import zyx_to_xyz

Points = NDArray[np.float64]  # (n, 3), um, (x, y, z), world
_RAYS = 20_000  # rays from a cell's centre, to integrate its volume
_GOLDEN = np.pi * (3 - 5**0.5)


class Truth(Protocol):
    """The true shapes of cells; `place` is the index of a cell, from 0."""

    volumes: NDArray[np.float64]  # um^3

    def distances(self, place: int, found: Nearest) -> NDArray[np.float64]:
        """Return the distances between a cell's true surface and the found one, (n,), um.

        They are measured from points on either surface.
        """


class BallsCut:
    """Balls round centres (z, y, x), um, cut by the planes midway to other centres.

    For a point outside, next to an edge, the distance from the nearest plane or sphere replaces the
    distance from the edge. It is a little smaller, because edges of these cells are obtuse.
    """

    def __init__(self, centres: NDArray[np.float64], radius: float, samples: int) -> None:
        self._centres, self._radius, self._samples = zyx_to_xyz(centres), radius, samples
        sphere = 4 / 3 * np.pi
        reaches = (self._rays(place, _RAYS)[1] for place in range(len(centres)))
        self.volumes = np.array([sphere * (reach**3).mean() for reach in reaches])

    def distances(self, place: int, found: Nearest) -> NDArray[np.float64]:
        outside = np.linalg.norm(found.points - self._centres[place], axis=1) - self._radius
        normals, halves = self._planes(place)
        beyond = (found.points - self._centres[place]) @ normals.T - halves
        there = np.abs(np.maximum(outside, beyond.max(axis=1, initial=-np.inf)))
        return np.concatenate([there, found.distances(self._points(place))])

    def _planes(self, place: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the planes that may cut a cell's ball, as normals (m, 3) and distances (m,).

        Distances are in um from the ball's centre.
        """
        ways = np.delete(self._centres, place, 0) - self._centres[place]
        lengths = np.linalg.norm(ways, axis=1)
        near = lengths < 2 * self._radius
        return ways[near] / lengths[near, None], lengths[near] / 2

    def _rays(
        self, place: int, count: int
    ) -> tuple[Points, NDArray[np.float64], NDArray[np.float64]]:
        """Return directions spread over the sphere, lengths of rays, and cosines at the surface."""
        turn = np.arange(count) * _GOLDEN
        z = 1 - (2 * np.arange(count) + 1) / count
        flat = np.sqrt(1 - z * z)
        rays = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
        normals, halves = self._planes(place)
        cosines = np.concatenate([rays @ normals.T, np.ones((count, 1))], axis=1)
        ahead = np.maximum(cosines, 1e-9)
        reaches = np.append(halves, self._radius) / ahead
        first = reaches.argmin(axis=1)
        each = np.arange(count)
        return rays, reaches[each, first], cosines[each, first]

    def _points(self, place: int) -> Points:
        """Return points of the cell's surface, spread evenly over its area."""
        rays, reach, cosines = self._rays(place, 4 * self._samples)
        area = np.cumsum(reach**2 / cosines)
        even = (np.arange(self._samples) + 0.5) / self._samples * area[-1]
        chosen = np.searchsorted(area, even)
        return self._centres[place] + rays[chosen] * reach[chosen, None]


class VoxelFaces:
    """The faces between voxels of a label map (z, y, x) of objects 1 to n, without gaps."""

    def __init__(
        self, labels: NDArray[np.int32], spacing_um: tuple[float, float, float], samples: int
    ) -> None:
        self.volumes = np.bincount(labels.ravel())[1:] * float(np.prod(spacing_um))
        self._faces = [
            Nearest(box_mesh(labels[box] == number, [s.start for s in box], spacing_um), samples)
            for number, box in enumerate(ndimage.find_objects(labels), start=1)
        ]

    def distances(self, place: int, found: Nearest) -> NDArray[np.float64]:
        faces = self._faces[place]
        return np.concatenate([faces.distances(found.points), found.distances(faces.points)])


def box_mesh(
    solid: NDArray[np.bool_], start: Sequence[int], spacing_um: tuple[float, float, float]
) -> Mesh:
    """Return the outer faces of voxels, not welded, in any winding; `start`: the first voxel."""
    padded = np.pad(solid, 1)
    squares = []
    for axis in range(3):
        ahead, right, up = np.roll(np.eye(3), -axis, axis=0) / 2
        middles = np.argwhere(np.diff(padded, axis=axis)) - 1 + ahead
        around = np.stack([-right - up, right - up, right + up, up - right])
        squares.append(middles[:, None] + around)
    corners = np.concatenate(squares).reshape(-1, 3)
    at = zyx_to_xyz((corners + start) * np.asarray(spacing_um)).astype(np.float32)
    first = np.arange(0, len(at), 4, dtype=np.uint32)[:, None, None]
    triangles = (first + np.array([[0, 1, 2], [0, 2, 3]], np.uint32)).reshape(-1, 3)
    return Mesh(at, triangles, np.zeros_like(at))


def split(mesh: Mesh, count: int) -> list[Mesh]:
    """Return each object of a mesh as its own mesh; vertices and triangles are sorted by object."""
    assert mesh.objects is not None
    places = np.arange(count + 1)
    firsts = np.searchsorted(mesh.objects, places)
    triangles = np.searchsorted(mesh.objects[mesh.triangles[:, 0]], places)
    return [
        Mesh(
            mesh.positions[firsts[k] : firsts[k + 1]],
            mesh.triangles[triangles[k] : triangles[k + 1]] - np.uint32(firsts[k]),
            mesh.normals[firsts[k] : firsts[k + 1]],
        )
        for k in range(count)
    ]


def volume_of(mesh: Mesh) -> float:
    """Return the volume that a closed mesh encloses, um^3."""
    if not len(mesh.triangles):
        return 0.0
    corners = mesh.positions.astype(np.float64)[mesh.triangles]
    corners -= corners[0, 0]
    return float((corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])).sum() / 6)


def measure_overlap(parts: Sequence[Nearest], count: int) -> float:
    """Return the share, 0..1, of the meshes' union that lies in two or more meshes.

    It tests `count` random points of the box round all meshes, most of which lie in a tissue's
    cells.
    """
    low = np.min([part.vertices.min(axis=0) for part in parts], axis=0)
    high = np.max([part.vertices.max(axis=0) for part in parts], axis=0)
    points = np.random.default_rng(1).uniform(low, high, (count, 3))
    points = points[np.argsort(points[:, 2])]
    times = np.zeros(count, np.int64)
    for part in parts:
        bottom, top = part.vertices.min(axis=0), part.vertices.max(axis=0)
        first, last = np.searchsorted(points[:, 2], [bottom[2], top[2]])
        there = points[first:last]
        near = first + np.flatnonzero(((there >= bottom) & (there <= top)).all(axis=1))
        if len(near):
            times[near] += part.holds(points[near])
    return float((times > 1).sum() / max((times > 0).sum(), 1))


def numbered(mask: NDArray[Any], fewest: int) -> NDArray[np.int32]:
    """Number the objects of a label map that have at least `fewest` voxels from 1 to n; 0 is none.

    >>> numbered(np.array([0, 7, 9, 9, 8, 9, 7]), 2).tolist()
    [0, 1, 2, 2, 0, 2, 1]
    """
    found, places, voxels = np.unique(mask, return_inverse=True, return_counts=True)
    kept = (found != 0) & (voxels >= fewest)
    return np.where(kept, np.cumsum(kept), 0)[places].reshape(mask.shape).astype(np.int32)
