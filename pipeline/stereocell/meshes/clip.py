"""Cut a surface off at the faces of a box, and leave it open there."""

from collections.abc import Sequence
from dataclasses import fields

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPlane, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkClipPolyData, vtkTriangleFilter

from stereocell.model.mesh import Mesh

_VALUES = [field.name for field in fields(Mesh) if field.name not in ("positions", "triangles")]


def clip_mesh(mesh: Mesh, low: Sequence[float], high: Sequence[float]) -> Mesh:
    """Return the part of a mesh inside a box. Values at new vertices are interpolated.

    low, high  corners (x, y, z), um; infinite: no cut on that side
    """
    surface = vtkPolyData()
    points = vtkPoints()
    points.SetData(numpy_to_vtk(mesh.positions, deep=True))
    surface.SetPoints(points)
    cells = vtkCellArray()
    cells.SetData(3, numpy_to_vtkIdTypeArray(mesh.triangles.astype(np.int64).ravel(), deep=True))
    surface.SetPolys(cells)
    for name in _VALUES:
        values = getattr(mesh, name)
        if values is not None:
            array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
            array.SetName(name)
            surface.GetPointData().AddArray(array)
    for axis in range(3):
        for end, facing in ((low[axis], 1.0), (high[axis], -1.0)):
            if np.isfinite(end):
                surface = _cut(surface, axis, end, facing)
    if not surface.GetNumberOfPolys():
        nothing = np.zeros((0, 3), np.float32)
        return Mesh(nothing, nothing.astype(np.uint32), nothing)
    data = surface.GetPointData()
    found = {name: data.GetArray(name) for name in _VALUES}
    values = {name: vtk_to_numpy(array) for name, array in found.items() if array is not None}
    triangles = vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    places = vtk_to_numpy(surface.GetPoints().GetData())
    return Mesh(places.astype(np.float32), triangles.astype(np.uint32), **values)


def _cut(surface: vtkPolyData, axis: int, end: float, facing: float) -> vtkPolyData:
    plane = vtkPlane()
    plane.SetOrigin(*(end if k == axis else 0.0 for k in range(3)))
    plane.SetNormal(*(facing if k == axis else 0.0 for k in range(3)))
    cut = vtkClipPolyData()
    cut.SetInputData(surface)
    cut.SetClipFunction(plane)
    triangles = vtkTriangleFilter()  # cutting a triangle may leave a quadrilateral
    triangles.SetInputConnection(cut.GetOutputPort())
    triangles.PassLinesOff()
    triangles.PassVertsOff()
    triangles.Update()
    return triangles.GetOutput()
