"""Lay out the buffers of a .glb with EXT_meshopt_compression, using the package meshopt."""

from typing import Any

import meshopt
import numpy as np
from numpy.typing import NDArray

_BYTE, _UNSIGNED_SHORT, _UNSIGNED_INT = 5120, 5123, 5125
_VERTICES, _INDICES = 34962, 34963  # bufferView.target


def reorder(
    triangles: NDArray[np.uint32], *, objects: NDArray[np.int32] | None = None
) -> tuple[NDArray[np.uint32], NDArray[np.intp]]:
    """Return the triangles in an order that suits the GPU's vertex cache, and the vertices to keep.

    triangles  uint32 (m, 3)
    objects    int32, the object of each vertex; the triangles are then grouped by object
    result     indices uint32 (3m,) into the kept vertices; kept vertices int64 (k,), in the order
               of their first use. Unused vertices are left out.
    """
    indices, order = _renumbered(np.asarray(triangles, dtype=np.uint32), is_reordered=True)
    if objects is None:
        return indices, order
    corners = order[indices].reshape(-1, 3)
    corners = corners[np.argsort(objects[corners[:, 0]], kind="stable")]
    return _renumbered(corners.astype(np.uint32), is_reordered=False)


def _renumbered(
    triangles: NDArray[np.uint32], *, is_reordered: bool
) -> tuple[NDArray[np.uint32], NDArray[np.intp]]:
    indices, places, count = meshopt.reorder_mesh(triangles, triangles=is_reordered, optsize=False)
    return indices, np.argsort(places)[:count]  # an unused vertex has the largest place


class CompressedBuffers:
    """The compressed binary chunk (buffer 0) and the layout of its decoded data (buffer 1).

    Buffer 1 has no data. It is the fallback of EXT_meshopt_compression, which readers that know the
    extension do not load.
    """

    def __init__(self) -> None:
        self._data = bytearray()
        self._decoded = 0
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []

    def add(self, data: bytes, *, alignment: int = 4) -> int:
        """Store bytes unchanged, at a multiple of `alignment`; return the bufferView's index."""
        start = self._align(alignment)
        self._views.append({"buffer": 0, **_offset(start), "byteLength": len(data)})
        self._data += data
        return len(self._views) - 1

    def add_directions(self, directions: NDArray[np.float64], kind: str) -> int:
        """Store unit vectors (n, 3), or tangents (n, 4) with a sign; return the accessor's index.

        kind  "VEC3" or "VEC4"

        The filter OCTAHEDRAL of EXT_meshopt_compression stores two coordinates on an octahedron, 8
        bits each. A reader decodes three (or four) signed bytes, at most 1.1 degrees off.
        """
        accessor = {"componentType": _BYTE, "normalized": True, "type": kind}
        return self.add_attribute(_octahedral(directions), accessor, filter_name="OCTAHEDRAL")

    def add_attribute(
        self, values: NDArray[Any], accessor: dict[str, Any], *, filter_name: str | None = None
    ) -> int:
        """Store one row per vertex; return the accessor's index.

        values    (n, k), rows of 4, 8, ... bytes
        accessor  glTF properties of the accessor, without the count
        """
        count, stride = len(values), values.itemsize * values.shape[1]
        # The extension requires version 0 of the vertex codec.
        encoded = meshopt.encode_gltf_buffer(values, "ATTRIBUTES", version=0)
        view = self._add_view(encoded, "ATTRIBUTES", count, stride)
        view["byteStride"] = stride
        view["target"] = _VERTICES
        if filter_name is not None:
            view["extensions"]["EXT_meshopt_compression"]["filter"] = filter_name
        return self._add_accessor({**accessor, "count": count})

    def add_indices(self, indices: NDArray[np.uint32], vertex_count: int) -> int:
        """Store triangles' indices, uint32 (3m,); return the accessor's index."""
        encoded = meshopt.encode_gltf_buffer(indices, "TRIANGLES")
        short = vertex_count <= 0xFFFF  # index 65535 itself would restart a strip
        view = self._add_view(encoded, "TRIANGLES", len(indices), 2 if short else 4)
        view["target"] = _INDICES
        kind = _UNSIGNED_SHORT if short else _UNSIGNED_INT
        return self._add_accessor(
            {"componentType": kind, "type": "SCALAR", "count": len(indices)},
        )

    def finish(self, document: dict[str, Any]) -> bytes:
        """Put accessors, bufferViews and buffers into the document; return the binary chunk."""
        self._align()
        document["accessors"] = self._accessors
        document["bufferViews"] = self._views
        document["buffers"] = [
            {"byteLength": len(self._data)},
            {
                "byteLength": self._decoded,
                "extensions": {"EXT_meshopt_compression": {"fallback": True}},
            },
        ]
        return bytes(self._data)

    def _add_view(self, encoded: bytes, mode: str, count: int, stride: int) -> dict[str, Any]:
        view: dict[str, Any] = {
            "buffer": 1,
            **_offset(self._decoded),
            "byteLength": count * stride,
            "extensions": {
                "EXT_meshopt_compression": {
                    "buffer": 0,
                    **_offset(self._align()),
                    "byteLength": len(encoded),
                    "byteStride": stride,
                    "count": count,
                    "mode": mode,
                }
            },
        }
        self._views.append(view)
        self._data += encoded
        self._decoded += -(-count * stride // 4) * 4
        return view

    def _add_accessor(self, accessor: dict[str, Any]) -> int:
        self._accessors.append({"bufferView": len(self._views) - 1, **accessor})
        return len(self._accessors) - 1

    def _align(self, alignment: int = 4) -> int:
        self._data += bytes(-len(self._data) % alignment)
        return len(self._data)


def _offset(start: int) -> dict[str, int]:
    """Return the member byteOffset of a new bufferView; the default, 0, is left out."""
    return {"byteOffset": start} if start else {}


def _octahedral(directions: NDArray[np.float64]) -> NDArray[np.int8]:
    """Return bytes (n, 4): x, y on the octahedron, the byte that means 1, a tangent's sign or 0."""
    x, y, z = (directions[:, :3] / np.abs(directions[:, :3]).sum(axis=1, keepdims=True)).T
    below = z < 0  # the lower half is folded over the edges of the upper half
    u = np.where(below, np.copysign(1 - np.abs(y), x), x)
    v = np.where(below, np.copysign(1 - np.abs(x), y), y)
    rest = [np.ones_like(u), directions[:, 3] if directions.shape[1] > 3 else np.zeros_like(u)]
    return np.rint(127 * np.stack([u, v, *rest], axis=1)).astype(np.int8)
