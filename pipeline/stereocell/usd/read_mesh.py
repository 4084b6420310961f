"""Read a mesh of a composed stage as triangles in the world, with one value per vertex.

The pipeline's own meshes are triangles with vertex normals and stay unchanged. The reader converts
the output of DCC tools: polygons, values per face corner, left-handed faces, and tiles that were
moved or mirrored.
"""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom

from stereocell.model.errors import StageError
from stereocell.model.mesh import Mesh
from stereocell.usd.primvar_names import PAINT
from stereocell.usd.read_attributes import require_still
from stereocell.usd.read_objects import objects_of
from stereocell.usd.typed_values import read_as, require_type

# Largest number of corners of a face. All triangles of a face share one corner, so the time to find
# intersections among them grows with the square of the number. Measured with `bundle` on 2 shared
# cores of an Intel Xeon: a flat face of 5000 corners took 90 s, one of 20 000 took 212 s.
MAX_CORNERS = 20_000
_Types = Sdf.ValueTypeNames
_PRIMVARS = {
    "normals": _Types.Normal3fArray,
    "st": _Types.TexCoord2fArray,
    "tangents": _Types.Float4Array,
    "displayColor": _Types.Color3fArray,
    "occlusion": _Types.FloatArray,
    PAINT: _Types.FloatArray,
}
_Values = tuple[NDArray[np.float32], str]  # values (n, k) and their interpolation


class LargeFaceError(StageError):
    """A mesh of the stage has a face with more than MAX_CORNERS corners."""


def read_mesh(
    mesh: UsdGeom.Mesh,
    to_world: NDArray[np.float64],
    *,
    shown: Collection[str] = (),
    is_edited: bool = False,
) -> Mesh | None:
    """Return the mesh in world um, at the default time; None if it has no faces.

    to_world   (4, 4), float64, for row vectors
    shown      primvars that the mesh's material reads: `displayColor`, `occlusion`
    is_edited  leave out primvars that do not fit the faces, instead of raising an error

    Raises StageError if the mesh's arrays contradict each other.
    """
    require_still(
        mesh.GetPointsAttr(), mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()
    )
    points = _values(mesh.GetPointsAttr(), _Types.Point3fArray, np.float32)
    counts = _values(mesh.GetFaceVertexCountsAttr(), _Types.IntArray, np.int64)
    indices = _values(mesh.GetFaceVertexIndicesAttr(), _Types.IntArray, np.int64)
    if len(counts) == 0:
        return None
    path = mesh.GetPath()
    _require_faces(path, counts, indices, len(points))
    corners = _triangulate(counts)
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        corners = corners[:, ::-1]
    primvars = UsdGeom.PrimvarsAPI(mesh)
    found = {
        "normals": _normals(mesh),
        "st": _primvar(primvars.GetPrimvar("st")),
        "tangents": _primvar(primvars.GetPrimvar("tangents")),
        **{name: _primvar(primvars.GetPrimvar(name)) for name in sorted(shown)},
    }
    values = {name: given for name, given in found.items() if given is not None}
    objects = objects_of(mesh)
    if objects is not None and (paint := _primvar(primvars.GetPrimvar(PAINT))) is not None:
        values["paint"] = paint
    if objects is not None and len(objects) == len(counts):
        values |= _at_vertices(values, indices, counts, len(points))
        objects = _of_vertices(np.repeat(objects, counts), indices, len(points))
    if is_edited:
        sizes = {"faceVarying": len(indices), "uniform": len(counts), "constant": 1}
        values = _fitting(values, sizes, len(points))
    if seams := _find_seams(primvars, values, indices, len(points)):
        point_of, indices = seams
        if objects is not None:
            objects = objects[point_of] if len(objects) == len(points) else None
        points = points[point_of]
        values = {
            name: (_primvar_values(primvars, name), "vertex")
            if kind == "faceVarying"
            else (array[point_of], kind)
            for name, (array, kind) in values.items()
        }
    if all(kind in ("vertex", "varying") for _, kind in values.values()):
        triangles = indices[corners]
        arrays = {name: array for name, (array, _) in values.items()}
        for name, array in arrays.items():
            if len(array) != len(points):
                raise StageError(
                    f"{path}: found {len(array)} {name}, expected {len(points)}, one for each point"
                )
    else:
        triangles, points, arrays = _split(path, points, indices, counts, corners, values)
    if "normals" not in arrays:
        arrays["normals"] = _smooth_normals(points, triangles)
    if objects is not None and len(objects) != len(points):  # an edit changed the faces
        objects = None
    return move_mesh(
        Mesh(
            points,
            np.ascontiguousarray(triangles, dtype=np.uint32),
            arrays["normals"],
            arrays.get("st"),
            arrays.get("tangents"),
            arrays.get("displayColor"),
            arrays.get("occlusion"),
            None if objects is None else objects.astype(np.int32),
            arrays.get("paint"),
        ),
        to_world,
    )


def _require_faces(
    path: Sdf.Path, counts: NDArray[np.int64], indices: NDArray[np.int64], points: int
) -> None:
    """Raise StageError if the faces contradict the other arrays or have too many corners."""
    if counts.min() < 3:
        raise StageError(
            f"{path}: faceVertexCounts[{counts.argmin()}]: found a face of {counts.min()} corners, "
            "expected at least 3"
        )
    if counts.sum() != len(indices):
        raise StageError(
            f"{path}: found {len(indices)} faceVertexIndices, expected {counts.sum()}, the sum of "
            "faceVertexCounts"
        )
    if (most := int(counts.max())) > MAX_CORNERS:
        raise LargeFaceError(
            f"{path}: faceVertexCounts[{counts.argmax()}]: found a face of {most} corners, "
            f"expected at most {MAX_CORNERS}: triangulate it in the program that edited it"
        )
    if indices.min() < 0 or indices.max() >= points:
        raise StageError(
            f"{path}: found faceVertexIndices from {indices.min()} to {indices.max()}, expected 0 "
            f"to {points - 1}"
        )


def _fitting(
    values: Mapping[str, _Values], sizes: Mapping[str, int], points: int
) -> dict[str, _Values]:
    """Return the primvars that fit the faces of an edited mesh; normals are always kept.

    sizes  number of values for each interpolation; all others have one value per point
    """
    kept = {
        name: (array, kind)
        for name, (array, kind) in values.items()
        if name == "normals" or len(array) == sizes.get(kind, points)
    }
    if "st" not in kept:
        kept.pop("tangents", None)
    return kept


def _values(attribute: Usd.Attribute, expected: Sdf.ValueTypeName, dtype: type) -> NDArray[Any]:
    return _array(read_as(attribute, expected), dtype)


def _array(value: object, dtype: type) -> NDArray[Any]:
    return np.array([] if value is None else value, dtype=dtype)


def _normals(mesh: UsdGeom.Mesh) -> _Values | None:
    """Return the normals of a mesh. USD prefers `primvars:normals` to `normals`."""
    primvar = _primvar(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals"))
    value = read_as(mesh.GetNormalsAttr(), _Types.Normal3fArray)
    if primvar is not None or value is None:
        return primvar
    return _array(value, np.float32), str(mesh.GetNormalsInterpolation())


def _primvar(primvar: UsdGeom.Primvar) -> _Values | None:
    if not primvar or not primvar.HasValue():
        return None
    flat = primvar.ComputeFlattened()
    if flat is not None:
        require_type(primvar.GetAttr().GetPath(), flat, _PRIMVARS[primvar.GetPrimvarName()])
    return _array(flat, np.float32), str(primvar.GetInterpolation())


def _find_seams(
    primvars: UsdGeom.PrimvarsAPI,
    values: Mapping[str, _Values],
    indices: NDArray[np.int64],
    points: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Find the vertices that the pipeline had before it joined them along the seams of charts.

    Returns the point of each vertex (n,) and the vertex of each face corner (m,). The pipeline
    writes UVs and tangents with the same indices and one value per vertex. Returns None if the mesh
    has primvars by face corner that do not follow this scheme.
    """
    by_corner = [name for name, (_, kind) in values.items() if kind == "faceVarying"]
    others = [array for array, kind in values.values() if kind in ("vertex", "varying")]
    is_known = {"st", "tangents"}.issuperset(by_corner)
    if not by_corner or not is_known or len(by_corner) + len(others) < len(values):
        return None
    if any(len(array) != points for array in others):
        return None
    found = [np.array(primvars.GetPrimvar(name).GetIndices(), np.int64) for name in by_corner]
    first, count = found[0], len(_primvar_values(primvars, by_corner[0]))
    if any(not np.array_equal(first, one) for one in found) or len(first) != len(indices):
        return None
    if any(len(_primvar_values(primvars, name)) != count for name in by_corner):
        return None
    point_of = np.full(count, -1)
    point_of[first] = indices
    is_whole = point_of.min(initial=0) >= 0 and np.array_equal(point_of[first], indices)
    return (point_of, first) if is_whole else None


def _primvar_values(primvars: UsdGeom.PrimvarsAPI, name: str) -> NDArray[np.float32]:
    return _array(primvars.GetPrimvar(name).Get(), np.float32)


def _at_vertices(
    values: dict[str, _Values], indices: NDArray[np.int64], counts: NDArray[np.int64], points: int
) -> dict[str, _Values]:
    """Convert values of faces to values of vertices, where all faces at each vertex agree."""
    found: dict[str, _Values] = {}
    for name, (array, kind) in values.items():
        if kind == "uniform" and len(array) == len(counts):
            moved = _of_vertices(np.repeat(array, counts, axis=0), indices, points)
            if moved is not None:
                found[name] = moved, "vertex"
    return found


def _of_vertices(
    corners: NDArray[Any], indices: NDArray[np.int64], points: int
) -> NDArray[Any] | None:
    """Convert values of face corners to values of vertices; None: they differ at a vertex."""
    moved = np.zeros((points, *corners.shape[1:]), corners.dtype)
    moved[indices] = corners
    return moved if np.array_equal(moved[indices], corners, equal_nan=True) else None


def _triangulate(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Split each face into a fan of triangles, and return their face corners (m, 3)."""
    starts = np.cumsum(counts) - counts
    if (counts == 3).all():
        return starts[:, np.newaxis] + np.arange(3)
    fans = counts - 2
    first = np.repeat(starts, fans)
    step = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    return np.stack([first, first + step + 1, first + step + 2], axis=1)


def _split(
    path: object,
    points: NDArray[np.float32],
    indices: NDArray[np.int64],
    counts: NDArray[np.int64],
    corners: NDArray[np.int64],
    values: dict[str, _Values],
) -> tuple[NDArray[np.int64], NDArray[np.float32], dict[str, NDArray[np.float32]]]:
    """Make a vertex for each face corner, and merge vertices that are equal in all values.

    Returns triangles (m, 3), points (n, 3) and the values per vertex. Raises StageError if the
    number of values does not fit their interpolation.
    """
    columns = {"points": points[indices]}
    for name, (array, kind) in values.items():
        expected = {"faceVarying": len(indices), "uniform": len(counts), "constant": 1}
        if len(array) != (wanted := expected.get(kind, len(points))):
            raise StageError(
                f"{path}: found {len(array)} {name}, expected {wanted} for {kind} interpolation"
            )
        if kind == "uniform":
            array = np.repeat(array, counts, axis=0)
        elif kind == "constant":
            array = np.repeat(array, len(indices), axis=0)
        elif kind != "faceVarying":
            array = array[indices]
        columns[name] = array.reshape(len(array), -1)
    rows = np.hstack(list(columns.values())) + np.float32(0)  # -0.0 becomes 0.0
    unique, vertex_of = np.unique(rows, axis=0, return_inverse=True)
    widths = np.cumsum([array.shape[1] for array in columns.values()])[:-1]
    parts = dict(zip(columns, np.hsplit(unique, widths), strict=True))
    split_points = np.ascontiguousarray(parts.pop("points"))
    for name in ("occlusion", "paint"):
        if name in parts:
            parts[name] = parts[name][:, 0]
    return vertex_of.reshape(-1)[corners], split_points, parts


def _smooth_normals(
    points: NDArray[np.float32], triangles: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Return unit normals (n, 3) at the vertices, each face weighted by its area."""
    a, b, c = (points[triangles[:, i]].astype(np.float64) for i in range(3))
    facing = np.cross(b - a, c - a)
    total = np.zeros((len(points), 3))
    for axis in range(3):
        weights = np.repeat(facing[:, axis], 3)
        total[:, axis] = np.bincount(triangles.ravel(), weights, minlength=len(points))
    lengths = np.linalg.norm(total, axis=1, keepdims=True)
    return (total / np.where(lengths == 0, 1, lengths)).astype(np.float32)


def move_mesh(mesh: Mesh, matrix: NDArray[np.float64]) -> Mesh:
    """Transform a mesh by a matrix (4, 4) for row vectors. The identity returns the mesh itself."""
    if np.array_equal(matrix, np.eye(4)):
        return mesh
    linear = matrix[:3, :3]
    positions = mesh.positions.astype(np.float64) @ linear + matrix[3, :3]
    normals = mesh.normals.astype(np.float64) @ np.linalg.inv(linear).T
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    mirrored = np.linalg.det(linear) < 0
    tangents = mesh.tangents
    if tangents is not None:
        along = tangents[:, :3].astype(np.float64) @ linear
        along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-30)
        sign = -tangents[:, 3:] if mirrored else tangents[:, 3:]
        tangents = np.hstack([along, sign]).astype(np.float32)
    return Mesh(
        positions.astype(np.float32),
        np.ascontiguousarray(mesh.triangles[:, ::-1]) if mirrored else mesh.triangles,
        normals.astype(np.float32),
        mesh.uvs,
        tangents,
        mesh.colors,
        mesh.openness,
        mesh.objects,
        mesh.paint,
    )
