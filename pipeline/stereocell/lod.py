"""Levels of detail: each simplified from the one before, each with its measured distance.

Simplification is meshoptimizer's (quadric errors, Garland & Heckbert 1997), bounded by an absolute
error in um. It only removes vertices, so normals stay valid, and borders are locked: the cut edges
on a common plane are the same at every level, and neighbours at different levels still meet.
"""

from dataclasses import dataclass
from typing import Any

import meshoptimizer
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import reference, vtkPoints
from vtkmodules.vtkCommonDataModel import (
    vtkCellArray,
    vtkGenericCell,
    vtkPolyData,
    vtkStaticCellLocator,
)

from stereocell.errors import UsageError
from stereocell.mesh import Mesh
from stereocell.options import setting


@dataclass(frozen=True, slots=True)
class LodOptions:
    """How levels of detail are made."""

    errors: tuple[float, ...] = setting(
        (0.1, 0.5, 2.0, 4.0), "simplification error of lod0, lod1, ..., in finest voxel spacings"
    )
    samples: int = setting(1000, "points at which distances are measured, each way")

    def __post_init__(self) -> None:
        if not self.errors or list(self.errors) != sorted(self.errors) or self.errors[0] <= 0:
            raise UsageError(f"lod.errors is {list(self.errors)}, expected rising positive numbers")
        if self.samples < 1:
            raise UsageError(f"lod.samples is {self.samples}, expected 1 or more")


FEWEST = 8  # triangles of a body that would vanish: an octahedron


def simplify(mesh: Mesh, max_error_um: float) -> Mesh:
    """Return the mesh with as few triangles as the error allows, border vertices untouched.

    The simplifier's error is a mean over planes: at a bound near a body's radius the whole body
    vanishes, or lies flat. Such a body is simplified by itself, down to FEWEST triangles.
    """
    kept = drop_doubles(_simplify(mesh.positions, mesh.triangles, max_error_um, 0))
    bodies = _bodies(mesh)
    body = bodies[mesh.triangles[:, 0]]
    vanished = np.flatnonzero(~np.isin(body, bodies[kept[:, 0]]))
    vanished = vanished[np.argsort(body[vanished], kind="stable")]
    ends = np.flatnonzero(np.diff(body[vanished])) + 1
    small = [
        _shrink(mesh, mesh.triangles[part], max_error_um)
        for part in np.split(vanished, ends)
        if len(part)
    ]
    return compact(mesh, np.concatenate([kept, *small]))


def _shrink(mesh: Mesh, triangles: NDArray[np.uint32], max_error_um: float) -> NDArray[np.uint32]:
    """Return FEWEST triangles, or as many as the error needs, in place of those of one body."""
    used, corners = np.unique(triangles, return_inverse=True)
    own = corners.reshape(-1, 3).astype(np.uint32)
    shrunk = drop_doubles(_simplify(mesh.positions[used], own, max_error_um, FEWEST))
    return used[shrunk] if len(shrunk) else triangles


def _simplify(
    positions: NDArray[np.float32], triangles: NDArray[np.uint32], max_error_um: float, fewest: int
) -> NDArray[np.uint32]:
    source = np.ascontiguousarray(triangles).ravel()
    result = np.empty_like(source)
    count = meshoptimizer.simplify(
        result,
        source,
        np.ascontiguousarray(positions),
        target_index_count=3 * fewest,
        target_error=max_error_um,
        options=meshoptimizer.SIMPLIFY_LOCK_BORDER | meshoptimizer.SIMPLIFY_ERROR_ABSOLUTE,
    )
    return result[:count].reshape(-1, 3)


def drop_doubles(triangles: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return the triangles without collapsed and repeated ones, in the same order.

    Two triangles of the same corners, wound against each other, are a sheet without thickness:
    both go. Each edge loses one in either direction, so that a closed mesh stays closed, and a
    border where it is. Of triangles wound alike the first stays.
    """
    a, b, c = np.sort(triangles, axis=1).T
    order = np.lexsort((c, b, a))
    a, b, c = a[order], b[order], c[order]
    new = np.ones(len(order), bool)
    new[1:] = (a[1:] != a[:-1]) | (b[1:] != b[:-1]) | (c[1:] != c[:-1])
    collapsed = (a == b) | (b == c)
    if new.all() and not collapsed.any():
        return triangles
    first, middle, last = triangles[order].T
    rising = (first < middle).astype(int) + (middle < last) + (last < first)
    winding = np.where(rising == 2, 1, -1)  # a cyclic turn of (a, b, c), or of (c, b, a)
    group = np.cumsum(new) - 1
    balance = np.bincount(group, winding)[group]
    stays = (winding * balance > 0) & ~collapsed
    # the first of its group that is wound as most are
    _, firsts = np.unique(group[stays], return_index=True)
    return triangles[np.sort(order[stays][firsts])]


def _bodies(mesh: Mesh) -> NDArray[np.int32]:
    """Return the number of the connected body that each vertex belongs to."""
    a, b, c = mesh.triangles.astype(np.int64).T
    count = len(mesh.positions)
    rows, columns = np.concatenate([a, b]), np.concatenate([b, c])
    edges = coo_matrix((np.ones(len(rows), bool), (rows, columns)), shape=(count, count))
    return connected_components(edges, directed=False)[1]


def compact(mesh: Mesh, triangles: NDArray[np.uint32]) -> Mesh:
    """Return the mesh of these triangles with the vertices that they use, in the same order."""
    used = np.zeros(len(mesh.positions), bool)
    used[triangles.ravel()] = True
    renumber = (np.cumsum(used) - 1).astype(np.uint32)
    return Mesh(mesh.positions[used], renumber[triangles], mesh.normals[used])


_BLOCK = 100_000
PERCENTILE = 99.0  # a sliver that vanishes, less than 1 % of the area, does not count


class Nearest:
    """Distances to the nearest point of a mesh; its search tree is built once.

    points  `samples` points (n, 3) spread evenly over the mesh's area
    """

    def __init__(self, mesh: Mesh, samples: int) -> None:
        self.points = spread_points(mesh, samples)
        self._locator = vtkStaticCellLocator()
        self._locator.SetDataSet(to_polydata(mesh))
        self._locator.BuildLocator()

    def distances(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distance in um from each of the points (n, 3)."""
        nearest, cell = [0.0, 0.0, 0.0], vtkGenericCell()
        # references: VTK writes its answers into them
        cell_id: Any = reference(0)
        sub_id: Any = reference(0)
        square: Any = reference(0.0)
        squares = []
        for point in points.tolist():
            self._locator.FindClosestPoint(point, nearest, cell, cell_id, sub_id, square)
            squares.append(square.get())
        return np.sqrt(squares)


def measure_distance(a: Nearest, b: Nearest) -> float:
    """Return the distance in um between two meshes: the 99th percentile, the larger of both ways.

    Points spread evenly over the area of each mesh go to the nearest point of the other.
    """
    there, back = b.distances(a.points), a.distances(b.points)
    return float(max(np.percentile(there, PERCENTILE), np.percentile(back, PERCENTILE)))


def spread_points(mesh: Mesh, count: int) -> NDArray[np.float64]:
    """Return `count` points (n, 3) spread evenly over the mesh's area, the same every time."""
    along = np.cumsum(_doubled_areas(mesh))
    place = np.arange(count)
    chosen = np.searchsorted(along, (place + 0.5) / count * along[-1], side="right")
    # inside the triangles: Roberts' R2 sequence (2018), folded over the diagonal
    u, v = (0.5 + place * 0.7548776662466927) % 1, (0.5 + place * 0.5698402909980532) % 1
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    corners = mesh.triangles[np.minimum(chosen, len(mesh.triangles) - 1)]
    a, b, c = mesh.positions[corners].astype(np.float64).transpose(1, 0, 2)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a)


def _doubled_areas(mesh: Mesh) -> NDArray[np.float64]:
    """Return twice each triangle's area, in blocks: millions of corners in float64 take a GB."""
    areas = np.empty(len(mesh.triangles))
    for start in range(0, len(areas), _BLOCK):
        part = slice(start, start + _BLOCK)
        a, b, c = mesh.positions[mesh.triangles[part]].astype(np.float64).transpose(1, 0, 2)
        areas[part] = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return areas


def to_polydata(mesh: Mesh) -> vtkPolyData:
    """Return the mesh as VTK's object; the arrays are copied."""
    points = vtkPoints()
    points.SetData(numpy_to_vtk(mesh.positions, deep=True))
    cells = vtkCellArray()
    offsets = np.arange(0, 3 * len(mesh.triangles) + 1, 3, dtype=np.int64)
    connectivity = mesh.triangles.ravel().astype(np.int64)
    cells.SetData(
        numpy_to_vtkIdTypeArray(offsets, deep=True),
        numpy_to_vtkIdTypeArray(connectivity, deep=True),
    )
    polydata = vtkPolyData()
    polydata.SetPoints(points)
    polydata.SetPolys(cells)
    return polydata
