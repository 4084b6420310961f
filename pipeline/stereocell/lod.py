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


def simplify(mesh: Mesh, max_error_um: float) -> Mesh:
    """Return the mesh with as few triangles as the error allows, border vertices untouched.

    The simplifier's error is a mean over planes: at a bound near a body's radius the whole body
    vanishes. A body of which nothing is left stays as it was.
    """
    source = np.ascontiguousarray(mesh.triangles).ravel()
    result = np.empty_like(source)
    count = meshoptimizer.simplify(
        result,
        source,
        np.ascontiguousarray(mesh.positions),
        target_index_count=0,
        target_error=max_error_um,
        options=meshoptimizer.SIMPLIFY_LOCK_BORDER | meshoptimizer.SIMPLIFY_ERROR_ABSOLUTE,
    )
    kept = result[:count].reshape(-1, 3)
    body = _bodies(mesh)
    vanished = ~np.isin(body[mesh.triangles[:, 0]], body[kept[:, 0]])
    return compact(mesh, np.concatenate([kept, mesh.triangles[vanished]]))


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


PERCENTILE = 99.0  # a sliver that vanishes, less than 1 % of the area, does not count


class Nearest:
    """Distances to the nearest point of a mesh; its search tree is built once."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
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


def measure_distance(a: Nearest, b: Nearest, samples: int) -> float:
    """Return the distance in um between two meshes: the 99th percentile, the larger of both ways.

    Points spread evenly over the area of each mesh go to the nearest point of the other.
    """
    there = b.distances(spread_points(a.mesh, samples))
    back = a.distances(spread_points(b.mesh, samples))
    return float(max(np.percentile(there, PERCENTILE), np.percentile(back, PERCENTILE)))


def spread_points(mesh: Mesh, count: int) -> NDArray[np.float64]:
    """Return `count` points (n, 3) spread evenly over the mesh's area, the same every time."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = np.cumsum(np.linalg.norm(doubled, axis=1))
    place = np.arange(count)
    chosen = np.searchsorted(along, (place + 0.5) / count * along[-1], side="right")
    # inside the triangles: Roberts' R2 sequence (2018), folded over the diagonal
    u, v = (0.5 + place * 0.7548776662466927) % 1, (0.5 + place * 0.5698402909980532) % 1
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = corners[np.minimum(chosen, len(corners) - 1)].transpose(1, 0, 2)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a)


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
