"""Extract the triangles of the iso-surface from a window of voxels, without cracks between tiles.

Neighbouring tiles share a plane of lattice points, and each tile extracts its own cells only. The
field depends only on dataset-wide numbers and on voxels inside the halo, so both tiles see the same
values on the common plane. The vertices there are equal bit by bit: their positions are computed in
lattice units and moved into the world in float64, by the same arithmetic in every tile.

Triangles come from VTK's Flying Edges.

References
W. Schroeder, R. Maynard & B. Geveci, "Flying edges: A high-performance scalable isocontouring
algorithm", IEEE LDAV 2015. doi:10.1109/LDAV.2015.7348069
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.gradients import move_off_zero
from stereocell.kernels.slopes import find_downhill
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.volume import zyx_to_xyz

# Least absolute value, as a share of the distance's clip. Values nearer to zero are moved to it,
# because a vertex on a lattice point would make degenerate triangles.
SNAP = 0.01
# Least distance of a crossing on a cut plane from the ends of its lattice edge, as a share of the
# edge. Simplification and fairing may not move vertices there, so a nearer crossing would leave
# short edges and sharp triangles. The 1st percentile of lod0's smallest angles, on tiles of nuclei
# and of membranes, is 13 and 15 degrees; at .05 it is 9 and 11. At .25 the shading of 1 % of the
# cut's points differed by 3 degrees between neighbours.
RIM_SNAP = 0.2


def extract_surface(
    distance: NDArray[np.float32], lattice: Lattice, *, cut_as: Lattice | None = None
) -> Mesh:
    """Return the surface distance = 0 between the lattice's own points; empty if there is none.

    distance  float32 (z, y, x), um, positive inside; covers `lattice.window`
    cut_as    the lattice whose cuts the surface follows at its ends, if it differs from `lattice`
    result    positions float32 (n, 3) in world um (x, y, z), triangles, normals

    The mesh is open where another tile follows. At the region's ends flat caps close it,
    `lattice.cap` spacings past the outermost points. Without a cap it is open there, too. Normals
    come from the field's gradient, and halos make them continuous across tiles. The normals of a
    cap point straight outwards.

    >>> from stereocell.model.tiling import Box
    >>> z, y, x = np.mgrid[:9, :9, :9]
    >>> ball = (3 - np.sqrt((z - 4) ** 2 + (y - 4) ** 2 + (x - 4) ** 2)).astype(np.float32)
    >>> box = Box((0, 0, 0), (9, 9, 9))
    >>> mesh = extract_surface(np.clip(ball, -2, 2), Lattice.of_whole(box, (1.0, 1.0, 1.0)))
    >>> mesh.positions.shape, mesh.triangles.shape
    ((150, 3), (296, 3))
    """
    own, region = lattice.own, lattice.region
    window = own.grown((2, 2, 2), lattice.window)  # slopes around the vertices need two more voxels
    distance = distance[window.slices_in(lattice.window)]
    limit = np.float32(2 * max(lattice.spacing_um))
    cap = [
        (int(lattice.cap is not None and a == low), int(lattice.cap is not None and b == high))
        for a, b, low, high in zip(own.start, own.stop, region.start, region.stop, strict=True)
    ]
    # Where the tile ends with the region, the window ends there, too, and gets the cap's margin.
    margin = np.array([low for low, _ in cap])
    distance = np.pad(distance, cap, constant_values=-limit)
    box = [
        (part.start, part.stop + low + high)
        for part, (low, high) in zip(own.slices_in(window), cap, strict=True)
    ]
    cuts = [
        (axis, place - window.start[axis] + cap[axis][0])
        for axis, place in (cut_as or lattice).cuts()
    ]
    snap = np.float32(SNAP) * limit
    points, triangles = _flying_edges(_snapped(distance, box, cuts, snap))
    if not len(triangles):
        empty = np.zeros((0, 3), np.float32)
        return Mesh(empty, np.zeros((0, 3), np.uint32), empty)

    steps, origin = np.asarray(lattice.spacing_um), np.asarray(lattice.origin_um)
    lattice_zyx = points[:, ::-1].astype(np.float64) + (np.asarray(own.start) - margin)
    outwards = _flatten_caps(lattice_zyx, lattice)
    positions = zyx_to_xyz(lattice_zyx * steps + origin).astype(np.float32)
    at = lattice_zyx - np.asarray(window.start) + margin
    on_cap = (outwards != 0).any(axis=1, keepdims=True)
    downhill = np.where(on_cap, outwards, find_downhill(distance, at, steps))
    normals = zyx_to_xyz(downhill).astype(np.float32)
    # VTK winds by the image's axes; the world mirrors y, so every triangle is turned over
    return Mesh(positions, np.ascontiguousarray(triangles[:, ::-1]), normals)


def _flatten_caps(points: NDArray[np.float64], lattice: Lattice) -> NDArray[np.float64]:
    """Move the points of caps onto planes, in place, and return normals (n, 3); zeros off the caps.

    A vertex past the outermost points lies on a lattice edge between one of these points and the
    padding. It stays on that edge, so the triangles stay valid.

    points  float64 (n, 3), (z, y, x) in lattice units
    """
    outwards = np.zeros_like(points)
    for axis, place in lattice.ends():
        is_low = place < lattice.own.start[axis]
        along = points[:, axis]
        past = along < lattice.own.start[axis] if is_low else along > lattice.own.stop[axis] - 1
        along[past] = place
        outwards[past, axis] = -1.0 if is_low else 1.0
    return outwards


def _snapped(
    distance: NDArray[np.float32],
    box: list[tuple[int, int]],
    cuts: list[tuple[int, int]],
    snap: np.float32,
) -> NDArray[np.float32]:
    """Return a copy of the values of a box, in which values near zero are moved away from it.

    cuts  axis and place of the planes where tiles meet; planes beside the box are ignored
    """
    values = distance[tuple(slice(*ends) for ends in box)].copy()
    move_off_zero(values, snap)
    for axis, at in cuts:
        low, high = box[axis]
        if low <= at < high:
            plane = np.moveaxis(values, axis, 0)[at - low]
            least = _least_on_plane(distance, box, axis, at, snap)
            np.copyto(plane, np.where(plane > 0, least, -least), where=np.abs(plane) < least)
    return values


def _least_on_plane(
    distance: NDArray[np.float32],
    box: list[tuple[int, int]],
    axis: int,
    at: int,
    snap: np.float32,
) -> NDArray[np.float32]:
    """Return the least absolute values that RIM_SNAP requires on a plane of the box.

    The function reads one point past the box, so that all tiles that share a point of the plane see
    all edges at that point.
    """
    wide = [slice(max(low - 1, 0), high + 1) for low, high in box]
    wide[axis] = slice(at, at + 1)
    plane = distance[tuple(wide)].copy()
    move_off_zero(plane, snap)
    size, inside = np.abs(plane), plane > 0
    least = np.zeros_like(size)
    ratio = np.float32(RIM_SNAP / (1 - RIM_SNAP))
    for along in {0, 1, 2} - {axis}:
        sizes, sign, wanted = (np.moveaxis(a, along, 0) for a in (size, inside, least))
        crosses = sign[:-1] != sign[1:]
        np.maximum(wanted[:-1], np.where(crosses, ratio * sizes[1:], 0), out=wanted[:-1])
        np.maximum(wanted[1:], np.where(crosses, ratio * sizes[:-1], 0), out=wanted[1:])
    part = [
        slice(low - cut.start, high - cut.start) for (low, high), cut in zip(box, wide, strict=True)
    ]
    part[axis] = slice(0, 1)
    return np.moveaxis(least[tuple(part)], axis, 0)[0]


def _flying_edges(values: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return points (x, y, z) in lattice units and triangles of values = 0."""
    # Importing VTK takes a tenth of a second, and a plan extracts no surface.
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    image = vtkImageData()
    image.SetDimensions(*values.shape[::-1])
    scalars = np.ascontiguousarray(values).ravel()  # VTK borrows the array, which must stay alive
    image.GetPointData().SetScalars(numpy_to_vtk(scalars))
    filter_ = vtkFlyingEdges3D()
    filter_.SetInputData(image)
    filter_.SetValue(0, 0.0)
    filter_.ComputeNormalsOff()
    filter_.ComputeScalarsOff()
    filter_.Update()
    output = filter_.GetOutput()
    if not output.GetNumberOfPolys():
        return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32)
    points = vtk_to_numpy(output.GetPoints().GetData()).astype(np.float32)
    triangles = vtk_to_numpy(output.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return points, triangles.astype(np.uint32)
