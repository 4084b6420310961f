"""Write compressed buffers of a glTF file, which becomes a fifth as large.

Only programs that support an extension can read it:

    meshopt  EXT_meshopt_compression and KHR_mesh_quantization: three, Babylon, Unity's glTFast
    draco    KHR_draco_mesh_compression: three, Babylon, Blender, Cesium

The vertices of all meshes lie on one lattice, as in formats/gltf.py, so there are no cracks between
tiles.
"""

import math
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.gltf import padded
from stereocell.formats.meshopt import CompressedBuffers, reorder
from stereocell.formats.plain_gltf import Buffers
from stereocell.model.extra_packages import import_extra
from stereocell.model.mesh import Mesh

_UNSIGNED_BYTE, _UNSIGNED_SHORT, _UNSIGNED_INT, _FLOAT = 5121, 5123, 5125, 5126
_STEPS = 1 << 16  # lattice points along the specimen's longest edge, since offsets have 16 bits
_DRACO_BITS, _NORMAL_BITS = 18, 10
_DRACO_TYPES = {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2}  # GeometryAttribute::Type of Draco


def packed_buffers(name: str, low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> Buffers:
    """Return the buffers that compress meshes by one of the two extensions.

    name           name of the compression, `meshopt` or `draco`
    low_m, high_m  corners (x, y, z) of the specimen's box, metres

    Raises UsageError if the library is not installed.
    """
    if name == "meshopt":
        return MeshoptBuffers(low_m, high_m)
    return DracoBuffers(low_m, high_m)


class MeshoptBuffers:
    """Buffers with 16-bit positions, which count from the lower corner of each mesh."""

    extensions: tuple[str, ...] = ("EXT_meshopt_compression", "KHR_mesh_quantization")

    def __init__(self, low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> None:
        # Larger than the tiles, since caps lie one voxel outside of them
        edge = float((high_m - low_m).max()) * 1.05
        self._step = 2.0 ** math.ceil(math.log2(edge / (_STEPS - 1)))
        self._buffers = CompressedBuffers()

    def add_mesh(
        self, mesh: Mesh, positions: NDArray[np.float64], colors: NDArray[np.uint8] | None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        indices, order = reorder(mesh.triangles)
        lattice = np.rint(positions[order] / self._step).astype(np.int64)
        origin = lattice.min(axis=0)
        offsets = (lattice - origin).clip(0, _STEPS - 1)
        ends = {"min": [0, 0, 0], "max": offsets.max(axis=0).tolist()}
        kind = {"componentType": _UNSIGNED_SHORT, "type": "VEC3", **ends}
        normals = mesh.normals[order].astype(np.float64)
        normals[~normals.any(axis=1)] = (0, 0, 1)
        attributes = {
            "POSITION": self._buffers.add_attribute(padded(offsets.astype(np.uint16)), kind),
            "NORMAL": self._buffers.add_directions(normals, "VEC3"),
        }
        if colors is not None:
            kind = {"componentType": _UNSIGNED_BYTE, "normalized": True, "type": "VEC3"}
            attributes["COLOR_0"] = self._buffers.add_attribute(padded(colors[order]), kind)
        primitive = {
            "attributes": attributes,
            "indices": self._buffers.add_indices(indices, len(order)),
        }
        return primitive, {
            "translation": (origin * self._step).tolist(),
            "scale": [self._step] * 3,
        }

    def finish(self, document: dict[str, Any], binary: BinaryIO) -> None:
        binary.write(self._buffers.finish(document))


class DracoBuffers:
    """Buffers with one Draco stream per mesh. The accessors have no bytes of their own."""

    extensions: tuple[str, ...] = ("KHR_draco_mesh_compression",)

    def __init__(self, low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> None:
        draco = import_extra("DracoPy", extra="draco", wanted_by="--compress draco")
        self._encode, self._decode = draco.encode, draco.decode
        edge = float((high_m - low_m).max())
        # Outside of the tiles, since caps lie one voxel outside of them
        self._origin = low_m - 0.05 * edge
        self._range = 1.1 * edge
        self._data = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []

    def add_mesh(
        self, mesh: Mesh, positions: NDArray[np.float64], colors: NDArray[np.uint8] | None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        # All meshes have the same lattice, so vertices that two tiles share stay equal.
        step = self._range / ((1 << _DRACO_BITS) - 1)
        places = (self._origin + np.rint((positions - self._origin) / step) * step).astype("<f4")
        stream = self._encode(
            places,
            np.ascontiguousarray(mesh.triangles, np.uint32),
            quantization_bits=_DRACO_BITS,
            quantization_range=self._range,
            quantization_origin=self._origin.tolist(),
            normals=mesh.normals.astype(np.float64),
            normal_quantization_bits=_NORMAL_BITS,
            colors=None if colors is None else np.ascontiguousarray(colors),
        )
        found = self._decode(stream)  # Draco may reorder, join or split vertices
        start = len(self._data)
        self._data += stream + bytes(-len(stream) % 4)
        self._views.append({"buffer": 0, "byteOffset": start, "byteLength": len(stream)})
        count = len(found.points)
        ends = {
            "min": (places.min(axis=0) - step).tolist(),
            "max": (places.max(axis=0) + step).tolist(),
        }
        attributes = {
            "POSITION": self._describe(_FLOAT, "VEC3", count, ends),
            "NORMAL": self._describe(_FLOAT, "VEC3", count),
        }
        if colors is not None:
            more = {"normalized": True}
            attributes["COLOR_0"] = self._describe(_UNSIGNED_BYTE, "VEC3", count, more)
        number_of = {one["attribute_type"]: one["unique_id"] for one in found.attributes}
        ids = {name: number_of[_DRACO_TYPES[name]] for name in attributes}
        packed = {"bufferView": len(self._views) - 1, "attributes": ids}
        primitive = {
            "attributes": attributes,
            "indices": self._describe(_UNSIGNED_INT, "SCALAR", found.faces.size),
            "extensions": {"KHR_draco_mesh_compression": packed},
        }
        return primitive, {}

    def finish(self, document: dict[str, Any], binary: BinaryIO) -> None:
        document["accessors"] = self._accessors
        document["bufferViews"] = self._views
        document["buffers"] = [{"byteLength": len(self._data)}]
        binary.write(self._data)

    def _describe(
        self, component: int, kind: str, count: int, more: dict[str, Any] | None = None
    ) -> int:
        accessor = {"componentType": component, "type": kind, "count": count, **(more or {})}
        self._accessors.append(accessor)
        return len(self._accessors) - 1
