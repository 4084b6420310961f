"""Distances between two meshes, measured in both directions."""

from copy import copy

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.half_edges import match_twins, measure_triangles
from stereocell.kernels.nearest import find_nearest, find_sides
from stereocell.meshes.triangle_grid import make_grid
from stereocell.model.mesh import Mesh, Spread

# Percent of the area; a sliver with less than 1 % of it may vanish without notice
PERCENTILE = 99.0
VERTICES = 50_000  # largest number of vertices that are measured for the largest distance
FACING = 20_000  # number of points at which the normals of two meshes are compared
# Mark of triangles that searches leave out; larger than the number of any point that is looked up
NEVER = np.int32(np.iinfo(np.int32).max)
# Um; points this close count as on the surface, because positions are rounded to float32
ON_UM = 1e-6


class Nearest:
    """Distances to the nearest point of a mesh. The search grid is made once.

    points     float64 (samples, 3), um, spread evenly over the mesh's area
    vertices   float64 (n, 3), um
    triangles  int32 (m, 3)
    twins      int32 (3 m,), twins of the half-edges, see `match_twins`; None: found when needed
    """

    def __init__(self, mesh: Mesh, samples: int, twins: NDArray[np.int32] | None = None) -> None:
        self.vertices = self._at = mesh.positions.astype(np.float64)
        self.triangles = self._own = np.ascontiguousarray(mesh.triangles, np.int32)
        self.points, _ = spread_points(self._at, self._own, samples)
        self._twins = twins
        grid = make_grid(self._at, self.triangles)
        # The triangles' boxes are not kept: they would take a third of a large unit's memory.
        self._cells = grid.first, grid.listed, grid.origin, grid.edge, grid.shape
        self._seen, self._tick = np.full(len(self.triangles), -1, np.int32), 0

    def without(self, gone: NDArray[np.bool_]) -> "Nearest":
        """Return the distances to a part of the mesh, with the same grid.

        gone  bool (n,), vertices of whole bodies that are left out; some must remain
        """
        part = copy(self)
        is_gone = gone[self.triangles[:, 0]]
        part._own = self.triangles[~is_gone]
        part.points, _ = spread_points(self._at, part._own, len(self.points))
        part.vertices = self._at[~gone]
        part._seen, part._tick = np.where(is_gone, NEVER, np.int32(-1)), 0
        return part

    def distances(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distance in um from each point, float64 (n,). points: (n, 3), um."""
        return self._find(points)[0]

    def nearest_triangles(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the number of the triangle nearest to each point (n, 3), int64 (n,)."""
        return self._find(points)[1]

    def normals_at(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the unit normal (n, 3) of the triangle nearest to each point (n, 3), um."""
        return _unit_normals(self._at, self.triangles[self.nearest_triangles(points)])

    def spread(self, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return points spread evenly over the area (count, 3), um, and the unit normals there."""
        points, chosen = spread_points(self._at, self._own, count)
        return points, _unit_normals(self._at, self._own[chosen])

    def holds(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which points (n, 3) lie inside the mesh, or within ON_UM of it."""
        distance, nearest, parts = self._find(points)
        if self._twins is None:
            self._twins = match_twins(self.triangles, len(self._at))
        inside = find_sides(points, nearest, parts, self._at, self.triangles, self._twins)
        return inside | (distance <= ON_UM)

    def _find(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int8]]:
        at = np.ascontiguousarray(points, np.float64)
        if self._tick + len(at) >= NEVER:
            self._seen[self._seen < NEVER], self._tick = -1, 0
        first, self._tick = self._tick, self._tick + len(at)
        return find_nearest(at, self._at, self.triangles, *self._cells, self._seen, first)


def measure_enclosure(source: Nearest, target: Nearest) -> float:
    """Return the share of the source's area that lies inside the target or on it, 0..1."""
    return float(target.holds(source.points).mean())


def measure_spread(source: Nearest, target: Nearest) -> Spread:
    """Return statistics of the distances, um, from one mesh to the other.

    Mean and percentiles are over the source's area. The maximum is also over its vertices, of which
    about VERTICES are measured, spread evenly over their order.
    """
    sampled = target.distances(source.points)
    few = source.vertices[:: -(-len(source.vertices) // VERTICES)]
    largest = max(float(sampled.max()), float(target.distances(few).max()))
    p95, p99 = (float(np.percentile(sampled, percent)) for percent in (95, PERCENTILE))
    return Spread(float(sampled.mean()), p95, p99, largest)


def measure_facing(source: Nearest, target: Nearest) -> float:
    """Return the agreement of two meshes' normals, from 1 (best) to -1.

    This is the cosine between a normal and that of the target's nearest triangle, averaged over
    FACING points of the source's area.
    """
    points, normals = source.spread(FACING)
    return float(np.einsum("nk,nk->n", normals, target.normals_at(points)).mean())


def _unit_normals(at: NDArray[np.float64], triangles: NDArray[np.integer]) -> NDArray[np.float64]:
    a, b, c = (at[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.maximum(lengths, np.finfo(np.float64).tiny))


def spread_points(
    at: NDArray[np.float64], triangles: NDArray[np.integer], count: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return points spread evenly over the area, (count, 3), um, and their triangles, (count,).

    at         float64 (n, 3), um
    triangles  (m, 3)

    The same mesh always gives the same points.
    """
    areas = measure_triangles(at, np.ascontiguousarray(triangles, np.int32))
    along = np.cumsum(areas)
    place = np.arange(count)
    chosen = np.searchsorted(along, (place + 0.5) / count * along[-1], side="right")
    # Positions within triangles follow the R2 sequence, folded over the diagonal: M. Roberts, "The
    # unreasonable effectiveness of quasirandom sequences", 2018
    u, v = (0.5 + place * 0.7548776662466927) % 1, (0.5 + place * 0.5698402909980532) % 1
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    chosen = np.minimum(chosen, len(triangles) - 1)
    a, b, c = at[triangles[chosen]].transpose(1, 0, 2)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), chosen
